#include "tests/support/integrity.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace vergence::test {
namespace {

/// Error of the motion between two poses; none: one of them is lost, or its truth is not known.
std::optional<MotionError> motion_error(const EvaluatedPose& from, const EvaluatedPose& to,
                                        const app::Trajectory& truth) {
  if (from.status == PoseStatus::lost || to.status == PoseStatus::lost) return {};
  const Transform *a = true_pose(truth, from.stamp), *b = true_pose(truth, to.stamp);
  if (a == nullptr || b == nullptr) return {};
  const Transform estimate = from.T_world_left.inverse() * to.T_world_left, is = a->inverse() * *b;
  return MotionError{(estimate.t - is.t).norm(), rotation_angle(estimate.R * is.R.transpose()),
                     is.t.norm()};
}

/// 0: not known, or no motion.
double times_normal(const std::optional<MotionError>& error, const EvaluatedPose& from,
                    const EvaluatedPose& to, const NormalError& normal) {
  if (!error || from.stamp == to.stamp) return 0;
  const MotionError usual = normal(from.stamp, to.stamp);
  return std::max(error->shift_m / std::max(usual.shift_m, kMinNormalShift * error->length_m),
                  error->turn_rad / std::max(usual.turn_rad, kMinNormalTurn));
}

/// The mean of errors.
class Mean {
 public:
  void add(const std::optional<MotionError>& e) {
    if (!e) return;
    sum_.shift_m += e->shift_m;
    sum_.turn_rad += e->turn_rad;
    ++count_;
  }
  [[nodiscard]] MotionError value() const {
    const double n = std::max(1, count_);
    return {.shift_m = sum_.shift_m / n, .turn_rad = sum_.turn_rad / n};
  }

 private:
  MotionError sum_;
  int count_ = 0;
};

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

NormalErrors normal_errors(std::span<const EvaluatedPose> poses, const app::Trajectory& truth) {
  NormalErrors errors{};
  for (std::size_t length = 1; length <= kLongestNormal; ++length) {
    Mean mean;
    for (std::size_t i = length; i < poses.size(); ++i)
      mean.add(motion_error(poses[i - length], poses[i], truth));
    errors[length] = mean.value();
  }
  return errors;
}

NormalError normal_error_there(std::vector<EvaluatedPose> poses, app::Trajectory truth) {
  const NormalErrors mean = normal_errors(poses, truth);
  // The errors of a later time are the mean ones, so the poses there cannot be counted.
  const double interval_s = poses.size() < 2
                                ? 1
                                : (poses.back().stamp - poses.front().stamp).to_seconds() /
                                      static_cast<double>(poses.size() - 1);
  return
      [mean, interval_s, poses = std::move(poses), truth = std::move(truth)](Stamp from, Stamp to) {
        constexpr Duration kAround = Duration::seconds(1.0);
        const auto frames = std::clamp<std::size_t>(
            static_cast<std::size_t>(std::llround((to - from).to_seconds() / interval_s)), 1,
            kLongestNormal);
        Mean around;
        for (std::size_t i = frames; i < poses.size(); ++i)
          if (poses[i].stamp >= to - kAround && poses[i].stamp <= to + kAround)
            around.add(motion_error(poses[i - frames], poses[i], truth));
        const MotionError here = around.value();
        return MotionError{.shift_m = std::max(mean[frames].shift_m, here.shift_m),
                           .turn_rad = std::max(mean[frames].turn_rad, here.turn_rad)};
      };
}

Integrity evaluate_integrity(std::span<const EvaluatedPose> poses, const NormalError& normal,
                             const app::Trajectory& truth) {
  Integrity h;
  // Indices of the first pose of the run.
  std::size_t posed_since = 0, ok_since = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].status == PoseStatus::lost) posed_since = i + 1, ++h.lost;
    if (poses[i].status != PoseStatus::ok) {
      ok_since = i + 1;
      continue;
    }
    ++h.ok;
    const std::size_t window = i < kIntegrityFrames ? 0 : i - kIntegrityFrames,
                      from = std::max(ok_since, window);
    const auto error = motion_error(poses[from], poses[i], truth);
    h.not_evaluated += error ? 0 : 1;
    const double claimed = times_normal(error, poses[from], poses[i], normal);
    h.most = std::max(h.most, claimed);
    if (i >= ok_since + kIntegrityFrames) h.max_full = std::max(h.max_full, claimed);
    if (claimed > kHonestyTimes && h.wrong++ == 0)
      h.first_wrong = i, h.first_error = *error, h.first_over = i - from;
    const std::size_t over = std::max(posed_since, window);
    if (times_normal(motion_error(poses[over], poses[i], truth), poses[over], poses[i], normal) >
        kHonestyTimes)
      ++h.wrong_over_all;
  }
  return h;
}

}  // namespace vergence::test
