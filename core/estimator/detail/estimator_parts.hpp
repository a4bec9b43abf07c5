#pragma once
#include <atomic>
#include <optional>

#include "core/estimator/degradations.hpp"
#include "core/estimator/detail/covariance_baseline.hpp"
#include "core/estimator/online_calibrator.hpp"
#include "core/estimator/transitions.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/odometry/drift_covariance.hpp"
#include "core/odometry/odometry.hpp"

/// Implementation of Estimator, shared by its sources.
namespace vergence {

struct Estimator::Parts {
  // Relative uncertainty of lengths without a calibration, in percent. The baseline length then
  // sets the scale and is assumed, not measured; such poses are degraded.
  static constexpr double kUnlinkedLengthPercent = 10;

  Parts(const EstimatorOptions& o, const RigCalibration& r, const RigCalibration& nominal,
        Arena& arena, PairRunner& runner, BackgroundRunner& solver)
      : options(o),
        odometry(options.odometry, r, o.trust != CalibrationTrust::none, arena, runner, o.masks),
        calibrator(options, r, nominal, arena, solver),
        length_sigma_percent(o.trust == CalibrationTrust::none
                                 ? kUnlinkedLengthPercent
                                 : o.calibration.max_depth_error_percent) {
    if (!options.online) return;
    degradations.enter(Degradation::calibration, Reason::unverified_calibration, 0);
  }

  void transition(Trigger trigger, Stamp stamp) noexcept {
    const Transition* t = find_transition(state, trigger);
    if (t == nullptr) return;
    EstimatorEvent e;
    e.stamp = stamp;
    e.kind = EstimatorEvent::Kind::state;
    e.from = t->from;
    e.to = t->to;
    e.why = t->why;
    (void)events.push(e);
    state = t->to;
  }
  void record(EstimatorEvent::Kind kind, Stamp stamp, const char* why, double value,
              const ChangeEvidence& evidence = {}) noexcept {
    EstimatorEvent e;
    e.stamp = stamp;
    e.kind = kind;
    e.from = e.to = state;
    e.why = why;
    e.value = value;
    e.evidence = evidence;
    (void)events.push(e);
  }

  void mark_calibration_unverified(std::uint64_t number) noexcept;
  [[nodiscard]] Mat6 motion_covariance(const odometry::FrameOutcome& out) const noexcept;
  void propagate(const odometry::FrameOutcome& out, PoseSample* sample) noexcept;
  void record_length_sigma(const CalibrationDecision& decision) noexcept;
  void suspect_rig(CalibrationCause cause, std::uint64_t onset, const RigFrame& frame,
                   const ChangeEvidence& evidence = {}) noexcept;
  void restart_estimation(std::optional<CalibrationCause> cause, std::uint64_t onset,
                          const RigFrame& frame) noexcept;
  void give_up_calibration(const RigFrame& frame, double frames) noexcept;
  void record_out_of_sync(Stamp stamp, double lag_frames) noexcept;
  void watch(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept;
  void watch_estimate(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept;
  void calibrate(const RigFrame& frame) noexcept;
  void apply(const CalibrationDecision& decision, Stamp stamp) noexcept;
  void adopt(const CalibrationDecision& decision) noexcept;
  void start_estimation(CalibrationCause cause, std::uint64_t onset,
                        const RigFrame& frame) noexcept;
  void apply_refinement(const CalibrationDecision& decision, Stamp stamp) noexcept;
  void notify_verified(Stamp stamp) noexcept;
  void follow(const odometry::FrameOutcome& out, const RigFrame& frame) noexcept;
  void notify_missing(Stamp stamp) noexcept;
  void update_degradations(const odometry::FrameOutcome& out, Pairing pairing) noexcept;
  void check_motion(const Mat6& motion, double step_m) noexcept;
  void weaken_degradations(const odometry::FrameOutcome& out, Stamp stamp) noexcept;
  [[nodiscard]] Reason why_uncalibrated() const noexcept;

  EstimatorOptions options;
  odometry::Odometry odometry;
  OnlineCalibrator calibrator;
  odometry::DriftCovariance drift{};
  CovarianceBaseline covariance_baseline{};
  // Margins of the decisions on the last frame.
  DecisionMargins margins{};
  DegradationLedger degradations{};
  // Standard deviation of all lengths, in percent, from the calibration in use.
  double length_sigma_percent;
  State state = State::initialising;
  Stamp last{};
  std::uint64_t last_number = 0;
  bool any = false;

  // Standard deviation of the depth by the verified calibration, in percent.
  double verified_percent = 0;
  // Evidence that the verified calibration is the rig's.
  ChangeEvidence verified_by;
  // True if an event has reported a wrong focal length.
  bool focal_contradicted = false;
  // True if an event has reported that the rig is not rigid, until a calibration is verified.
  bool not_rigid = false;
  // True if this frame's pose differs from the last one by more than its uncertainty.
  bool moves = false;

  int without_pose = 0;
  // True if a gap was reported and has not ended.
  bool in_gap = false;
  // Number of consecutive frames without stereo matches.
  int unmatched_frames = 0;
  Reason notified_missing = Reason::none;

  std::atomic<bool> requested{false};
  // One frame records at most eight events.
  FixedVector<EstimatorEvent, 16> events;
  // finish() makes at most three decisions.
  FixedVector<CalibrationDecision, 3> decisions;
};

}  // namespace vergence
