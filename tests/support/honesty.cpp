#include "tests/support/honesty.hpp"

#include <algorithm>
#include <utility>

namespace vergence::test {
namespace {

/// Error of the motion between two poses, m; negative: the truth is not known at one of them.
double motion_error(const JudgedPose& from, const JudgedPose& to, const app::Trajectory& truth) {
  const Transform *a = true_pose(truth, from.stamp), *b = true_pose(truth, to.stamp);
  if (a == nullptr || b == nullptr) return -1;
  const Vec3 estimate = (from.T_world_left.inverse() * to.T_world_left).t;
  return (estimate - (a->inverse() * *b).t).norm();
}

}  // namespace

const Transform* true_pose(const app::Trajectory& truth, Stamp stamp) {
  auto at = std::lower_bound(truth.begin(), truth.end(), stamp,
                             [](const StampedPose& p, Stamp s) { return p.stamp < s; });
  if (at != truth.begin() && (at == truth.end() || at->stamp - stamp > stamp - (at - 1)->stamp))
    --at;
  if (at == truth.end()) return nullptr;
  const Duration apart = at->stamp > stamp ? at->stamp - stamp : stamp - at->stamp;
  return apart <= Duration::milliseconds(3) ? &at->T_world_body : nullptr;
}

NormalErrors normal_errors(std::span<const JudgedPose> poses, const app::Trajectory& truth) {
  NormalErrors sum{};
  for (std::size_t length = 1; length <= kHonestyFrames; ++length) {
    int count = 0;
    for (std::size_t i = length; i < poses.size(); ++i) {
      const double error = motion_error(poses[i - length], poses[i], truth);
      if (error < 0) continue;
      sum[length] += error;
      ++count;
    }
    sum[length] /= std::max(1, count);
  }
  return sum;
}

NormalError normal_error_there(std::vector<JudgedPose> poses, app::Trajectory truth) {
  const NormalErrors mean = normal_errors(poses, truth);
  return [mean, poses = std::move(poses), truth = std::move(truth)](Stamp at, std::size_t frames) {
    constexpr Duration kAround = Duration::seconds(1.0);
    double sum = 0;
    int count = 0;
    for (std::size_t i = frames; i < poses.size(); ++i) {
      if (poses[i].stamp < at - kAround || poses[i].stamp > at + kAround) continue;
      const double error = motion_error(poses[i - frames], poses[i], truth);
      if (error < 0) continue;
      sum += error;
      ++count;
    }
    return count == 0 ? mean[frames] : std::max(mean[frames], sum / count);
  };
}

Honesty judge_honesty(std::span<const JudgedPose> poses, const NormalError& normal,
                      const app::Trajectory& truth) {
  Honesty h;
  std::size_t posed_since = 0, ok_since = 0;  // indices of the first pose of the run
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].status == PoseStatus::lost) posed_since = i + 1, ++h.lost;
    if (poses[i].status != PoseStatus::ok) {
      ok_since = i + 1;
      continue;
    }
    ++h.ok;
    const auto times = [&](std::size_t since) {
      const std::size_t from = std::max(since, i < kHonestyFrames ? 0 : i - kHonestyFrames);
      return from == i
                 ? 0.0
                 : motion_error(poses[from], poses[i], truth) / normal(poses[i].stamp, i - from);
    };
    const double claimed = times(ok_since);
    h.most = std::max(h.most, claimed);
    if (i >= ok_since + kHonestyFrames) h.most_full = std::max(h.most_full, claimed);
    if (claimed > kHonestyTimes && h.wrong++ == 0) h.first_wrong = i;
    h.wrong_over_all += times(posed_since) > kHonestyTimes ? 1 : 0;
  }
  return h;
}

}  // namespace vergence::test
