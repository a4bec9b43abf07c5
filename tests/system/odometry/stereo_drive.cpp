#include "tests/system/odometry/stereo_drive.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "app/runtime/background_thread.hpp"
#include "core/memory/allocation_guard.hpp"
#include "core/memory/frame_pool.hpp"

namespace vergence::test {

OwnedImage::OwnedImage(int w, int h)
    : width(w),
      height(h),
      stride(static_cast<std::ptrdiff_t>(FramePool::stride(w))),
      bytes(FramePool::stride(w) * static_cast<std::size_t>(h)) {}

Replay replay(const StereoDrive& drive, const Edit& edit, int threads, bool online) {
  EstimatorOptions options;
  options.online = online;
  Arena arena(Estimator::memory_needed(options, drive.rig));
  SequentialRunner one;
  std::optional<app::ThreadRunner> two;
  if (threads == 2) two.emplace();
  ImmediateRunner solver;
  Estimator estimator(options, drive.rig, drive.rig, arena,
                      two ? static_cast<PairRunner&>(*two) : one, solver);
  Replay out;
  out.answers.reserve(drive.size());
  const std::uint64_t before = AllocationGuard::runtime_allocations();
  for (std::size_t i = 0; i < drive.size(); ++i) {
    RigFrame frame;
    frame.number = i;
    frame.stamp = drive.stamps[i];
    frame.cameras = 2;
    for (std::size_t k = 0; k < 2; ++k) frame.images[k] = drive.pairs[i][k].view();
    if (edit && !edit(i, &frame)) continue;
    Answer a;
    {
      const SealedScope sealed;
      a.sample = estimator.process(frame);
    }
    for (const EstimatorEvent& e : estimator.events())
      a.restarted = a.restarted || e.kind == EstimatorEvent::Kind::map_reset;
    a.T_reference_left = drive.truth[i];
    out.answers.push_back(a);
  }
  out.allocations = AllocationGuard::runtime_allocations() - before;
  return out;
}

MotionError motion_error(const Answer& from, const Answer& to) {
  const Transform estimated = from.sample.T_world_left.inverse() * to.sample.T_world_left;
  const Transform real = from.T_reference_left.inverse() * to.T_reference_left;
  return {(estimated.t - real.t).norm(), log_so3(estimated.R * real.R.transpose()).norm()};
}

std::string wrong_ok(const std::vector<Answer>& answers, const OkBound& bound) {
  std::string worst;
  double worst_ratio = 1.0;
  const Answer* first = nullptr;
  const Answer* previous = nullptr;
  double way = 0;
  for (const Answer& a : answers) {
    if (a.restarted) first = nullptr;
    if (!good(a.sample)) continue;
    if (first == nullptr) {
      first = previous = &a;
      way = 0;
      continue;
    }
    way += (a.T_reference_left.t - previous->T_reference_left.t).norm();
    previous = &a;
    const MotionError e = motion_error(*first, a);
    const double ratio = std::max(e.translation / (bound.translation + bound.per_metre * way),
                                  e.rotation / bound.rotation);
    if (ratio <= worst_ratio) continue;
    worst_ratio = ratio;
    worst = fmt::format(
        "frame {} is called ok, yet since frame {} ({:.2f} m) it is {:.3f} m and {:.4f} rad off",
        a.sample.frame, first->sample.frame, way, e.translation, e.rotation);
  }
  return worst;
}

int count_ok(const std::vector<Answer>& answers, std::size_t first, std::size_t last) {
  int n = 0;
  for (const Answer& a : answers)
    n += a.sample.frame >= first && a.sample.frame < last && good(a.sample) ? 1 : 0;
  return n;
}

std::string story(const std::vector<Answer>& answers) {
  std::string text;
  for (std::size_t i = 0; i < answers.size();) {
    const PoseSample& first = answers[i].sample;
    std::size_t end = i;
    int inliers = first.inliers;
    for (; end < answers.size(); ++end) {
      const PoseSample& s = answers[end].sample;
      if (s.status != first.status || s.reason != first.reason ||
          (answers[end].restarted && end != i))
        break;
      inliers = std::min(inliers, s.inliers);
    }
    text +=
        fmt::format("frames {} to {}: {} {}, at least {} inliers{}\n", first.frame,
                    answers[end - 1].sample.frame, to_string(first.status), to_string(first.reason),
                    inliers, answers[i].restarted ? ", scene restarted" : "");
    i = end;
  }
  return text;
}

}  // namespace vergence::test
