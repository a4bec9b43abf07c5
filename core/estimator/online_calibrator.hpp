#pragma once
#include <optional>

#include "core/calibration/gates.hpp"
#include "core/estimator/calibration_frames.hpp"
#include "core/estimator/estimator.hpp"
#include "core/estimator/rig_monitor.hpp"
#include "core/estimator/states.hpp"

namespace vergence {

/// Calibrates the rig online: collects frames, monitors the calibration in use, runs solves in the
/// background and decides on their solutions. The estimator passes posed frames and acts on the
/// decisions. states.hpp has the states of the calibration in use.
///
/// There are two modes. *Estimating*: there is no calibration, or the one in use is suspect; the
/// frames since the onset are solved until a solution passes the gates. *Refining* otherwise:
/// solutions verify, contradict or refine the calibration in use. They are from a growing segment
/// of frames; a full one is closed, and its result is the prior of the next.
///
///     calibrator.frames().add(odometry, out, frame);  // every posed frame
///     if (calibrator.can_solve()) calibrator.start_solve();
///     if (const auto decision = calibrator.decide(frame.stamp, frame.number))
///       if (decision->accepted) calibrator.adopt(*decision);
///
/// Threads  One caller. A solve runs on the BackgroundRunner's thread, one at a time, with copies
///          of the tracks and of its prior; the destructor waits for it. Memory from the arena at
///          construction.
class OnlineCalibrator {
 public:
  OnlineCalibrator(const EstimatorOptions& options, const RigCalibration& rig,
                   const RigCalibration& nominal, Arena& arena, BackgroundRunner& runner);
  ~OnlineCalibrator();
  OnlineCalibrator(const OnlineCalibrator&) = delete;
  OnlineCalibrator& operator=(const OnlineCalibrator&) = delete;

  /// Frames that calibrations are solved from; call add() with each posed frame.
  [[nodiscard]] CalibrationFrames& frames() noexcept { return frames_; }
  /// Monitor of the rig; call update() with each posed frame.
  [[nodiscard]] RigMonitor& monitor() noexcept { return monitor_; }

  /// Starts estimating a new calibration. Frames before frame number `onset` belong to another rig
  /// and are dropped, and a running solve of them is discarded. Without a cause, the previous
  /// estimation's cause is kept.
  void start_estimation(std::optional<CalibrationCause> cause, std::uint64_t onset,
                        std::uint64_t now) noexcept;
  [[nodiscard]] bool estimating() const noexcept {
    return state_ == CalibrationState::none || state_ == CalibrationState::suspect;
  }
  /// True if there are enough frames and no solve is running.
  [[nodiscard]] bool can_solve() const noexcept { return !solving_ && frames_.enough(); }
  /// Copies the logged frames and starts the solver on them.
  void start_solve() noexcept;
  /// Starts a last solve with all logged frames. Returns false if they are too few.
  [[nodiscard]] bool start_last_solve() noexcept;
  /// True until the decision on the last solve.
  [[nodiscard]] bool solving() const noexcept { return solving_; }
  /// Call after every frame. Returns the decision if a solve has finished and was evaluated. Waits
  /// for the solver with Adoption::after_fixed_frames only.
  [[nodiscard]] std::optional<CalibrationDecision> decide(Stamp stamp,
                                                          std::uint64_t number) noexcept;
  /// Call after the last frame: waits for the running solve and decides.
  [[nodiscard]] std::optional<CalibrationDecision> decide_now(Stamp stamp,
                                                              std::uint64_t number) noexcept;
  /// Time that the last decide() waited for the solver, in ms.
  [[nodiscard]] float waited_ms() const noexcept { return waited_ms_; }
  [[nodiscard]] calibration::Gate last_gate() const noexcept { return gate_; }

  /// Reason why the estimation makes no progress, needs_motion or needs_near_structure; `none` if
  /// nothing is known to be missing.
  [[nodiscard]] Reason missing() const noexcept;

  /// Call when the map was rebuilt with the adopted calibration; monitoring of the rig starts here.
  void map_rebuilt(const odometry::Odometry& odometry) noexcept;
  /// Drops all frames and restarts the monitors, because earlier frames no longer describe the rig.
  /// The calibration in use stays.
  void clear_frames() noexcept;
  /// Call when the map was lost. Logged tracks end there, and earlier measurements no longer apply,
  /// because the rig may have changed meanwhile.
  void map_lost() noexcept;
  /// Adopts the calibration of this decision. The logged frames of a refined one stay.
  void adopt(const CalibrationDecision& found) noexcept;
  /// Ends the estimation without a result: the calibration in use is as good and is kept.
  void keep() noexcept;
  /// Adopts an earlier calibration again, because the images fit it.
  void restore(const RigCalibration& rig) noexcept;
  [[nodiscard]] const RigCalibration& in_use() const noexcept { return rig_; }
  [[nodiscard]] bool calibrated() const noexcept { return state_ != CalibrationState::none; }
  [[nodiscard]] bool verified() const noexcept { return state_ == CalibrationState::verified; }

 private:
  /// Cause and progress of an estimation.
  struct Search {
    CalibrationCause cause = CalibrationCause::from_scratch;
    // Numbers of the first frame of the changed rig and of the frame in which the estimation
    // started.
    std::uint64_t onset = 0, since = 0;
    /// Frames before a change were dropped once; the remaining ones count as frames of one rig.
    bool frames_before_change_dropped = false;
    /// The rig changed during the frames of the newest solve.
    bool changed_in_solve = false;
    /// Number of new frames that the last rejection made the next solve wait for.
    std::size_t wait = 0;
  };
  struct Task {
    OnlineCalibrator* calibrator;
    void operator()() const noexcept { calibrator->run_solve(); }
  };

  /// Runs on the solver's thread.
  void run_solve() noexcept;
  /// Marks a running solve as outdated, because its frames no longer describe the rig.
  void discard_solve() noexcept { discarded_ = solving_; }
  /// True if the solve was discarded or does not match the present mode.
  [[nodiscard]] bool outdated() const noexcept {
    return discarded_ || request_.from_rig == estimating();
  }
  /// An estimate must fit better than the calibration in use; for refinements,
  /// evaluate_refinement() has its own comparison.
  [[nodiscard]] calibration::Gate gate() const noexcept;
  /// Compares the solution with the calibration `current`.
  [[nodiscard]] calibration::Assessment assess(
      const RigCalibration& current, calibration::CalibrationOrigin source) const noexcept;
  void set_state(CalibrationTrigger what) noexcept;
  /// `misfit_px`: median distance of matches from the epipolar lines beyond their noise.
  void apply_assessment(CalibrationTrigger what, double misfit_px) noexcept;
  /// True if the calibration in use was solved from images together with its intrinsics, in this
  /// run or an earlier one; its epipolar lines are more accurate than those of a supplied one.
  [[nodiscard]] bool solved_from_images() const noexcept { return !rig_.covariance.empty(); }
  /// Clears the extrinsics of the prior when another rig is adopted; the intrinsics stay.
  void clear_prior() noexcept;
  /// `last`: no more frames follow.
  [[nodiscard]] std::optional<CalibrationDecision> evaluate(Stamp stamp, std::uint64_t number,
                                                            bool last) noexcept;
  void evaluate_estimate(CalibrationDecision* d) noexcept;
  void evaluate_refinement(bool last, CalibrationDecision* d) noexcept;
  /// Chooses the frames of the next solve from the gate's result.
  void plan_search() noexcept;
  void plan_refinement() noexcept;

  const EstimatorOptions& options_;
  const RigCalibration given_, nominal_;
  RigCalibration rig_;
  CalibrationState state_;
  calibration::CalibrationOrigin source_ = calibration::CalibrationOrigin::elsewhere;
  // Posterior of the closed segments; before, the prior of the supplied calibration.
  std::optional<RigCalibration> refined_;
  CalibrationFrames frames_;
  Search search_;
  calibration::Gate gate_ = calibration::Gate::open;

  BackgroundRunner& runner_;
  Task task_{this};
  bool solving_ = false, discarded_ = false;
  int frames_since_start_ = 0;
  // Number of frames after the start of the solve at which the next decision is due.
  int next_decision_ = 0;
  float waited_ms_ = 0;
  // Used by the solver's thread during a solve, which also reads options_, given_ and
  // focal_known_.
  calibration::RigSolver solver_;
  calibration::RigSolveRequest request_;
  RigCalibration prior_;
  calibration::RigSolution solved_;
  FocalMeasurement solved_focal_;
  // Newest accepted measurement of the focal length, and true if a full solve has agreed with the
  // configured value.
  FocalMeasurement focal_;
  bool focal_known_ = false;

  RigMonitor monitor_;
};

}  // namespace vergence
