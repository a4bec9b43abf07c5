#pragma once
#include <optional>

#include "core/calibration/gates.hpp"
#include "core/estimator/background_solve.hpp"
#include "core/estimator/calibration_frames.hpp"
#include "core/estimator/calibration_states.hpp"
#include "core/estimator/estimator.hpp"
#include "core/estimator/rig_monitor.hpp"

namespace vergence {

class SolutionReview;

/// Calibrates the rig while it drives: collects frames, monitors the calibration in
/// use, has calibrations solved in the background and decides about them. The estimator hands in
/// posed frames and acts on the decisions. The state of the calibration in use is one of the table
/// in calibration_states.hpp; the states of the odometry belong to the estimator.
///
/// There are two modes. *Estimating*: there is no calibration, or the one in use is suspect; the
/// frames since the onset are solved until a solution passes the gates. *Refining*: at all other
/// times; the solution verifies, contradicts or refines the calibration in use. A refinement solves
/// repeatedly while its segment of frames grows; a full segment is closed, and its result is the
/// prior of the next.
///
///     calibrator.frames().take(odometry, out, frame);  // every posed frame
///     if (calibrator.can_solve()) calibrator.start_solve();
///     if (const auto decision = calibrator.decide(frame.stamp, frame.number))
///       if (decision->accepted) calibrator.use(*decision);
///
/// Threads one, but for the solver's task. Memory from the arena at construction.
class OnlineCalibrator {
 public:
  OnlineCalibrator(const EstimatorOptions& options, const RigCalibration& rig,
                   const RigCalibration& nominal, Arena& arena, BackgroundRunner& solver);
  [[nodiscard]] static std::size_t memory_needed(const EstimatorOptions& options,
                                                 const RigCalibration& rig) noexcept;

  /// Frames that calibrations are solved from; call take() with each posed frame.
  [[nodiscard]] CalibrationFrames& frames() noexcept { return frames_; }
  /// Monitor of the rig; call update() with each posed frame.
  [[nodiscard]] RigMonitor& monitor() noexcept { return monitor_; }

  /// Starts estimating a new calibration. Frames before frame number `onset` belong to another rig
  /// and are dropped, and a running solve of them is discarded. Without a cause, that of the
  /// estimation before is kept.
  void start_estimation(std::optional<CalibrationCause> cause, std::uint64_t onset,
                        std::uint64_t now) noexcept;
  [[nodiscard]] bool estimating() const noexcept {
    return state_ == CalibrationState::none || state_ == CalibrationState::suspect;
  }
  /// True if there are frames enough to solve from and no solve is running.
  [[nodiscard]] bool can_solve() const noexcept;
  /// Takes a snapshot and starts the solver on it.
  void start_solve() noexcept;
  /// The background solve: whether it is running, and how long the last decide() waited for it.
  [[nodiscard]] const BackgroundSolve& solve() const noexcept { return solve_; }
  /// Call after every frame. Returns the decision if the solve is over and was decided about.
  [[nodiscard]] std::optional<CalibrationDecision> decide(Stamp stamp,
                                                          std::uint64_t number) noexcept;
  /// Call after the last frame: waits for the running solve and decides.
  [[nodiscard]] std::optional<CalibrationDecision> decide_now(Stamp stamp,
                                                              std::uint64_t number) noexcept;
  /// Starts a last solve with all that is logged. Returns false if that is too little.
  [[nodiscard]] bool start_last_solve() noexcept;
  [[nodiscard]] calibration::Gate last_gate() const noexcept { return gate_; }

  /// What the estimation lacks: needs_motion or needs_near_structure; `none` if nothing is known to
  /// be missing.
  [[nodiscard]] Reason missing() const noexcept;

  /// Call when the scene of the calibration in use was made; the rig is monitored from here on.
  void map_rebuilt(const odometry::Odometry& odometry) noexcept;
  /// Drops all frames and restarts the monitors; the calibration in use stays. For when earlier
  /// frames no longer describe the rig.
  void clear_frames() noexcept;
  /// Call when the scene was lost. Logged tracks end there, and earlier measurements of the rig do
  /// not show that it was left alone meanwhile.
  void map_lost() noexcept;
  /// Puts the estimated calibration of this decision into use.
  void use(const CalibrationDecision& found) noexcept;
  /// Puts a refined calibration into use; the logged frames stay.
  void refine(const RigCalibration& rig) noexcept;
  /// Ends the estimation without a result: the calibration in use is as good and stays.
  void keep() noexcept;
  /// Puts an earlier calibration back into use, because the images fit it.
  void restore(const RigCalibration& rig) noexcept;
  [[nodiscard]] const RigCalibration& in_use() const noexcept { return rig_; }
  [[nodiscard]] bool calibrated() const noexcept { return state_ != CalibrationState::none; }
  [[nodiscard]] bool verified() const noexcept { return state_ == CalibrationState::verified; }

 private:
  /// Cause and progress of an estimation.
  struct Search {
    CalibrationCause cause = CalibrationCause::from_scratch;
    std::uint64_t onset = 0, since = 0;  // frame numbers
    /// Frames before a change were dropped once; the rest count as frames of one rig.
    bool change_believed = false;
    /// Rejections for other reasons than too few frames.
    int rejections = 0;
  };

  /// `misfit_px`: median distance of matches from the epipolar lines beyond their noise.
  void apply_assessment(CalibrationTrigger what, double misfit_px) noexcept;
  /// True if the calibration in use was solved from images, this drive's or an earlier one's, with
  /// its intrinsics; its epipolar lines are more accurate than those of a supplied one.
  [[nodiscard]] bool found() const noexcept { return !rig_.covariance.empty(); }
  [[nodiscard]] SolutionReview review() const noexcept;
  /// `last`: no more frames follow.
  [[nodiscard]] std::optional<CalibrationDecision> evaluate(Stamp stamp, std::uint64_t number,
                                                            bool last) noexcept;
  [[nodiscard]] CalibrationDecision evaluate_estimate(Stamp stamp, std::uint64_t number) noexcept;
  [[nodiscard]] CalibrationDecision evaluate_refinement(Stamp stamp, std::uint64_t number,
                                                        bool last) noexcept;
  /// Chooses the frames of the next solve from the gate's result.
  void plan_search() noexcept;
  void plan_refinement() noexcept;

  const EstimatorOptions& options_;
  RigCalibration rig_, nominal_;
  CalibrationState state_;
  calibration::CalibrationOrigin source_ = calibration::CalibrationOrigin::elsewhere;
  std::optional<RigCalibration> refined_;  // posterior of the closed segments
  CalibrationFrames frames_;
  BackgroundSolve solve_;
  RigMonitor monitor_;
  Search search_;
  calibration::Gate gate_ = calibration::Gate::open;
};

}  // namespace vergence
