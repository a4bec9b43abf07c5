#pragma once
#include <memory>
#include <string>

#include "core/comparison/trajectory_metrics.hpp"
#include "core/estimator/estimator.hpp"
#include "tests/system/odometry/stereo_drive.hpp"

namespace vergence::test {

struct EstimatorRunOptions {
  EstimatorOptions options{};
  /// Calibration that the estimator receives.
  RigCalibration initial;
  /// Calibration that the gates compare with.
  RigCalibration nominal;
  /// 1 runs everything on the caller's thread; 2 runs the front end on two and the solver on a
  /// third.
  int threads = 2;
};

/// The rig's own calibration, as a user supplies it.
[[nodiscard]] EstimatorRunOptions with_supplied(const RigCalibration& rig);
/// Uses only the rig's intrinsics, which are fixed, and its baseline length.
[[nodiscard]] EstimatorRunOptions from_scratch(const RigCalibration& rig);
/// The rig's own calibration with the sigmas that sixty frames give; intrinsics are fixed.
[[nodiscard]] EstimatorRunOptions with_calibration(const RigCalibration& rig);

struct TimedDecision {
  std::uint64_t frame;
  CalibrationDecision decision;
};
struct TimedEvent {
  std::uint64_t frame;
  EstimatorEvent event;
};

/// Estimate of one frame, and the true pose of the left camera when its image was taken.
struct FrameResult {
  PoseSample sample;
  Transform T_reference_left{};
  /// True if a map reset is reported with this frame.
  bool map_reset = false;
};

/// A change of one frame before the estimator sees it. False: the frame is left out.
using Edit = std::function<bool(std::size_t index, RigFrame* frame)>;

/// One estimator over a drive, and everything it reported.
class EstimatorRun {
 public:
  explicit EstimatorRun(const EstimatorRunOptions& options);
  ~EstimatorRun();

  void process(const RigFrame& frame, const Transform& T_reference_left);
  /// Frames [first, last) of a drive in memory.
  void process(const StereoDrive& drive, std::size_t first = 0,
               std::size_t last = std::numeric_limits<std::size_t>::max(), const Edit& edit = {});
  void finish();

  [[nodiscard]] const std::vector<FrameResult>& results() const noexcept { return results_; }
  /// Decisions about calibrations being estimated; refinements during odometry are left out.
  [[nodiscard]] const std::vector<TimedDecision>& decisions() const noexcept { return decisions_; }
  /// The last accepted calibration; null if there is none.
  [[nodiscard]] const CalibrationDecision* accepted() const noexcept;
  [[nodiscard]] int count_accepted() const noexcept;
  /// The first event of a kind; null if there is none.
  [[nodiscard]] const TimedEvent* first(EstimatorEvent::Kind kind) const noexcept;
  /// Returns true if a decision rejected a calibration for this reason.
  [[nodiscard]] bool rejected_for(const std::string& reason) const noexcept;
  /// Runtime allocations since the constructor, on every thread that works for the estimator.
  [[nodiscard]] std::uint64_t allocations() const noexcept;
  [[nodiscard]] const Estimator& estimator() const noexcept;
  /// Statuses, events and decisions, for the message of a failed expectation.
  [[nodiscard]] std::string describe() const;

 private:
  void record(std::uint64_t frame);

  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::vector<FrameResult> results_;
  std::vector<TimedDecision> decisions_;
  std::vector<TimedEvent> events_;
  std::uint64_t allocations_before_;
  std::uint64_t last_ = 0;
};

/// `ok`, or `degraded` only because the calibration is not verified yet: all that can be asked of
/// the odometry itself.
[[nodiscard]] inline bool usable(const PoseSample& s) noexcept {
  return s.status == PoseStatus::ok ||
         (s.status == PoseStatus::degraded && s.reason == Reason::unverified_calibration);
}
/// Usable frames in [first, last).
[[nodiscard]] int count_usable(const std::vector<FrameResult>& results, std::size_t first,
                               std::size_t last);

/// Difference of two relative motions over the same pair of frames.
struct MotionError {
  /// Error in m.
  double translation = 0;
  /// Error in rad.
  double rotation = 0;
};
[[nodiscard]] MotionError motion_error(const FrameResult& from, const FrameResult& to);

/// Describes the usable pose whose error relative to the first one since the drive's start or the
/// last reported map reset exceeds the limits most; empty if there is none.
[[nodiscard]] std::string false_ok(const std::vector<FrameResult>& results);

/// The poses of all frames that are not lost against the truth; segments of these lengths in m.
[[nodiscard]] TrajectoryEvaluation evaluate_results(const std::vector<FrameResult>& results,
                                                    const std::vector<double>& lengths);

/// Difference of a calibration from the true one.
struct RigError {
  /// Largest rotation about an axis in rad.
  double rotation = 0;
  Vec3 t = Vec3::Zero();
  // The largest of the six in its noise-only sigma. t_x of camera 1, whose length is supplied, is
  // left out.
  double sigmas = 0;
};
[[nodiscard]] RigError rig_error(const RigCalibration& found, int k, const Transform& truth);
[[nodiscard]] std::string to_string(const RigError& e);

}  // namespace vergence::test
