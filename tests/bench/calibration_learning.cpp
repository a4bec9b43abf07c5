// What a calibration gains by driving on: one recorded road to and fro, and an hour of the mock's
// streets, of which the truth is known.
#include "tests/bench/calibration_learning.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "app/runtime/thread_runner.hpp"
#include "app/session/drive_calibration.hpp"
#include "core/calibration/health.hpp"
#include "core/estimator/estimator.hpp"
#include "core/math/so3.hpp"
#include "tests/support/recorded_sequence.hpp"
#include "tests/support/rendered_drive.hpp"

namespace vergence::bench {
namespace {

using app::StartingCalibration;
using app::StereoSequence;

constexpr double kMockRate = 10;              // Hz, as the recorded drives
constexpr double kFocalLengthFactor = 1.001;  // of the right camera as given; its prior's sigma
constexpr double kCentreOffset = 5;           // px, half of its prior's

/// Which of many decisions is printed: each a quarter later in the drive than the one before.
class Rows {
 public:
  [[nodiscard]] bool due(std::uint64_t frame) {
    if (frame < next_) return false;
    next_ = frame + std::max<std::uint64_t>(1, frame / 4);
    return true;
  }

 private:
  std::uint64_t next_ = 0;
};

}  // namespace

int run_learning(const std::vector<std::string>& set, int times) {
  const app::Configuration c = app::load_configuration(std::nullopt, set);
  const auto d = test::open_recorded("kitti00_151");
  if (!d) {
    fmt::print(stderr,
               "calibration_bench: no recorded drives; set VERGENCE_SHARED to the folder that "
               "holds data/\n");
    return 2;
  }
  // To and fro over the same road: the speed changes its sign at the ends, the rig stays what it
  // is.
  StereoSequence s = d->sequence;
  const std::size_t n = d->sequence.pairs.size();
  const Duration step = d->sequence.pairs[1].stamp - d->sequence.pairs[0].stamp;
  s.pairs.clear();
  for (int time = 0; time < times; ++time)
    for (std::size_t i = time == 0 ? 0 : 1; i < n; ++i) {
      app::StereoPair pair = d->sequence.pairs[time % 2 == 0 ? i : n - 1 - i];
      pair.stamp = s.pairs.empty() ? d->sequence.pairs[0].stamp : s.pairs.back().stamp + step;
      s.pairs.push_back(pair);
    }
  const StartingCalibration scratch = test::blank(app::replayed_calibration(c, s, false));
  int knocks = 0;
  const auto rig = app::drive_once(
      {s, c, 0, s.pairs.size(), {}, {}}, scratch,
      [&](const Estimator& e, const PoseSample& sample) {
        for (const EstimatorEvent& event : e.events())
          knocks += event.kind == EstimatorEvent::Kind::rig_changed ? 1 : 0;
        for (const CalibrationDecision& decision : e.calibrations()) {
          const RigCalibration& r = decision.calibration;
          const Vec3 phi = 1e3 * log_so3(r.T_camera_left[1].R), t = 1e3 * r.T_camera_left[1].t;
          fmt::print(
              "frame {:5d} {:8s} {:4d} frames  yaw {:.3f} ({:.3f}) mrad  t_y {:.2f} t_z {:.2f} mm  "
              "cx {:.2f} ({:.2f})  depth ± {:.2f} %  held "
              "out {:.4f} px  {:.0f} ms\n",
              sample.frame,
              decision.accepted ? "adopted"
              : decision.learnt ? "kept"
                                : "rejected",
              r.frames, phi.y(), 1e3 * r.sigma_noise[1][1], t.y(), t.z(), r.intrinsics[1].cx,
              r.intrinsics[1].sigma[2], decision.depth_sigma_percent, decision.held_out_after_px,
              decision.solve_ms);
          std::fflush(stdout);
        }
      });
  fmt::print("{} knocks told\n", knocks);
  if (!rig) return 1;
  StartingCalibration learnt = app::replayed_calibration(c, d->sequence, false);
  learnt.file.rig = *rig;
  const test::DriveOutcome r = test::drive_recorded(*d, d->sequence, c, learnt);
  fmt::print("with what was learnt: segments {:.3f} %, ATE {:.4f} m, scale {:.4f}\n",
             r.segments_percent, r.ate_m, r.scale);
  return 0;
}

int run_mock_learning(const std::vector<std::string>& set, int frames) {
  const app::Configuration c = app::load_configuration(std::nullopt, set);
  test::RenderedDriveOptions o;
  o.rate = kMockRate;
  o.to_and_fro = true;
  o.drive.kind = mock::DriveKind::figure_eight;
  test::RenderedDrive rendered(o);
  RigCalibration blank = o.rig;
  for (Transform& T : blank.T_camera_left) T = {};
  Intrinsics& right = blank.intrinsics[1];
  right.fx *= kFocalLengthFactor;
  right.fy *= kFocalLengthFactor;
  right.cx += kCentreOffset;

  EstimatorOptions options;
  options.odometry = c.odometry;
  options.calibration = c.calibration;
  options.monitor = c.monitor;
  options.trust = CalibrationTrust::none;
  Arena arena(Estimator::memory_needed(options, blank));
  app::ThreadRunner two;
  ImmediateRunner solver;
  Estimator estimator(options, blank, blank, arena, two, solver);
  const Vec3 truth = 1e3 * log_so3(o.rig.T_camera_left[1].R);
  Rows rows;
  int knocks = 0, ok = 0, since = 0, adopted = 0;
  for (int i = 0; i < frames; ++i) {
    const PoseSample s = estimator.process(rendered.frame(static_cast<std::uint64_t>(i)));
    since += adopted > 0 ? 1 : 0;
    ok += s.status == PoseStatus::ok ? 1 : 0;
    for (const EstimatorEvent& event : estimator.events())
      knocks += event.kind == EstimatorEvent::Kind::rig_changed ? 1 : 0;
    for (const CalibrationDecision& d : estimator.calibrations()) {
      if (!d.accepted) continue;
      ++adopted;
      if (!rows.due(static_cast<std::uint64_t>(i))) continue;
      const RigCalibration& r = d.calibration;
      const Vec3 turn = 1e3 * log_so3(r.T_camera_left[1].R) - truth;
      const Vec3 shift = 1e3 * (r.T_camera_left[1].t - o.rig.T_camera_left[1].t);
      const auto wide = [&](std::size_t k) { return 1e3 * r.sigma_wide[1][k]; };
      fmt::print(
          "frame {:5d}  errors: x {:+.3f} ({:.3f}) y {:+.3f} ({:.3f}) z {:+.3f} ({:.3f}) mrad  t_y "
          "{:+.2f} ({:.2f}) t_z {:+.2f} ({:.2f}) mm  cx {:+.2f} ({:.2f}) px  depth at 20 m {:.3f} "
          "({:.3f}) %\n",
          i, turn.x(), wide(0), turn.y(), wide(1), turn.z(), wide(2), shift.y(), wide(4), shift.z(),
          wide(5), r.intrinsics[1].cx - o.rig.intrinsics[1].cx, r.intrinsics[1].sigma[2],
          calibration::depth_difference_percent(r, o.rig, 1, 20.0),
          calibration::depth_error_percent(r, 1, 20.0));
      std::fflush(stdout);
    }
  }
  fmt::print("{} frames, {} calibrations adopted, {} ok of {} since the first, {} knocks told\n",
             frames, adopted, ok, since, knocks);
  return 0;
}

}  // namespace vergence::bench
