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

/// The rig's calibration while it drives (METHOD §3, §6): collects frames, watches that they fit,
/// has calibrations solved beside the frames and decides about them. The estimator reports what
/// was posed and follows its advice. What is known of the calibration in use is a state of the
/// table in calibration_states.hpp; the states of the odometry are the estimator's.
///
/// Two things are solved for. *Seeking*: there is no calibration, or the one in use is doubted;
/// frames since the onset, until one passes the gates. *Learning*: all the time else; what the
/// drive itself measures, lenses free, confirms the calibration in use, or contradicts it, or
/// refines it. Learning grows a segment of frames, solving again and again; a full segment is
/// closed, and what it measured is the next one's prior.
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

  /// What calibrations are solved from: take() posed frames.
  [[nodiscard]] CalibrationFrames& frames() noexcept { return frames_; }
  /// What watches the rig: update() it with posed frames.
  [[nodiscard]] RigMonitor& monitor() noexcept { return monitor_; }

  /// From now on a calibration is sought. Frames before `onset` belong to another rig and are
  /// forgotten, and so is a solve of them that is still under way. No cause: that of the search
  /// before.
  void seek(std::optional<CalibrationCause> cause, std::uint64_t onset, std::uint64_t now) noexcept;
  [[nodiscard]] bool seeking() const noexcept {
    return state_ == CalibrationState::none || state_ == CalibrationState::suspect;
  }
  /// There are frames enough to solve from and no solve is under way.
  [[nodiscard]] bool can_solve() const noexcept;
  /// Takes a snapshot and starts the solver on it.
  void start_solve() noexcept;
  /// Whether it is under way, and how long the last decide() waited for it.
  [[nodiscard]] const BackgroundSolve& solve() const noexcept { return solve_; }
  /// After every frame. A value: the solve is over and decided.
  [[nodiscard]] std::optional<CalibrationDecision> decide(Stamp stamp,
                                                          std::uint64_t number) noexcept;
  /// No more frames come: waits for the solve under way and decides.
  [[nodiscard]] std::optional<CalibrationDecision> decide_now(Stamp stamp,
                                                              std::uint64_t number) noexcept;
  /// And this begins one with whatever is logged; false: that is too little.
  [[nodiscard]] bool start_last_solve() noexcept;
  [[nodiscard]] calibration::Gate last_gate() const noexcept { return gate_; }

  /// What the calibration sought waits for: needs_motion, needs_near_structure; `none` if nothing
  /// is known to be missing.
  [[nodiscard]] Reason missing() const noexcept;

  /// Another calibration is in use, whose scene has just been made; it is watched from here on.
  void map_rebuilt(const odometry::Odometry& odometry) noexcept;
  /// Frames until now say nothing about the rig from here on: monitors and log begin again, the
  /// calibration in use stays.
  void clear_frames() noexcept;
  /// The scene was lost: what is logged does not go on, and what was learnt of the rig is no
  /// witness that nobody knocked it meanwhile.
  void map_lost() noexcept;
  /// The calibration in use is the one of this decision, which was sought.
  void use(const CalibrationDecision& found) noexcept;
  /// The same of one that was learnt: the frames stay.
  void refine(const RigCalibration& rig) noexcept;
  /// The one in use goes on: what was sought is no better.
  void keep() noexcept;
  /// The one that was in use before it, or before another was sought, is again: the images fit it.
  void take_back(const RigCalibration& rig) noexcept;
  [[nodiscard]] const RigCalibration& in_use() const noexcept { return rig_; }
  [[nodiscard]] bool calibrated() const noexcept { return state_ != CalibrationState::none; }
  [[nodiscard]] bool verified() const noexcept { return state_ == CalibrationState::verified; }

 private:
  /// What a calibration is sought for, and how that goes.
  struct Search {
    CalibrationCause cause = CalibrationCause::from_scratch;
    std::uint64_t onset = 0, since = 0;  // frame numbers
    bool change_believed = false;  // frames were left out for a change once: the rest are taken for
                                   // one rig
    int rejections = 0;            // for other reasons than a want of frames
  };

  /// `misfit_px`: how far off the epipolar lines of the one in use are.
  void learnt_of_it(CalibrationTrigger what, double misfit_px) noexcept;
  /// The calibration in use was solved from images, this drive's or an earlier one's, and its
  /// lenses with it: its epipolar lines hold better than those of a claim.
  [[nodiscard]] bool found() const noexcept { return !rig_.covariance.empty(); }
  [[nodiscard]] SolutionReview review(bool last) const noexcept;
  /// `last`: no more frames come that could make it better.
  [[nodiscard]] std::optional<CalibrationDecision> judge(Stamp stamp, std::uint64_t number,
                                                         bool last) noexcept;
  [[nodiscard]] CalibrationDecision evaluate_estimate(const SolutionReview& review, Stamp stamp,
                                                      std::uint64_t number) noexcept;
  [[nodiscard]] CalibrationDecision evaluate_refinement(const SolutionReview& review, Stamp stamp,
                                                        std::uint64_t number, bool last) noexcept;
  /// What the gate says of the frames to solve from next.
  void plan_search(const calibration::RigSolution& found) noexcept;
  void plan_learning(const calibration::RigSolution& found) noexcept;

  const EstimatorOptions& options_;
  RigCalibration rig_, nominal_;
  CalibrationState state_;
  calibration::ClaimSource source_ = calibration::ClaimSource::elsewhere;
  bool found_with_lenses_ = false;
  std::optional<RigCalibration> learnt_;  // what closed segments show, with the lenses free
  CalibrationFrames frames_;
  BackgroundSolve solve_;
  RigMonitor monitor_;
  Search search_;
  calibration::Gate gate_ = calibration::Gate::open;
};

}  // namespace vergence
