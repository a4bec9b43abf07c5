#pragma once
#include "core/calibration/rig_solver.hpp"
#include "core/math/robust.hpp"
#include "core/types/calibration_decision.hpp"

namespace vergence::calibration {

/// Residuals of a calibration on frames that it was not solved from: distances of stereo matches to
/// their epipolar lines.
struct HeldOut {
  int frames = 0;
  double median_px = 0;
};

/// Maximum median distance in px from the epipolar lines of a calibration that fits; on recorded
/// sequences it is 0.08 to 0.3 px.
inline constexpr double kMaxFitPx = 0.5;
/// Maximum numbers of held-out frames of a test and of matches of each, which bound its time.
inline constexpr std::size_t kHeldOutFrames = 12, kHeldOutMatches = 150;

/// Measures the fit on frames newer than frame number `after`: at most the newest kHeldOutFrames,
/// and at most kHeldOutMatches of each. With several additional cameras the worst one counts, in
/// its own pixels. Pure.
[[nodiscard]] HeldOut held_out(const TrackLog& log, std::uint64_t after,
                               const RigCalibration& rig) noexcept;

/// Returns true if `better` fits those frames better than `worse` by more than chance: the mean
/// over frames of the difference of medians exceeds `chance` of its standard errors. Also true if
/// too few frames can be compared. The gains of several cameras are added, so that a knocked one
/// outweighs one that is determined slightly less well. Pure.
[[nodiscard]] bool fits_better(const TrackLog& log, std::uint64_t after,
                               const RigCalibration& better, const RigCalibration& worse,
                               double chance = kChance) noexcept;

/// Comparison of the calibration in use with the online estimate.
///
/// The difference d of their depths at reference_depth_m() decides between two hypotheses: the rig
/// is the one of the calibration in use, whose error is usual for its kind (sigma m), or it is
/// another one (sigma M). With s, the sigma of the estimate,
///
///     log_odds = log N(d; 0, m² + s²) − log N(d; 0, M² + s²).
struct Assessment {
  /// Depth of the comparison, from reference_depth_m().
  double depth_m = 0;
  double sigma_percent = 0;
  /// Difference of the depths there, root mean square over the image.
  double difference_percent = 0;

  /// Log odds that the rig is the one of the calibration in use.
  double log_odds = 0;
  /// Log odds with the prior over those that decide: above 1 it is verified, below −1 contradicted,
  /// if the depths are within or beyond the tolerated error as well.
  double certainty = 0;
  /// Evidence for that, or against it if log_odds is negative.
  ChangeEvidence evidence;

  /// True if the estimate's depths are significantly more accurate.
  bool nearer = false;
  /// True if the estimate should replace the calibration in use: it is nearer and fits held-out
  /// frames no worse, or it fits them better where the one in use misses them.
  bool better = false;
  /// True if the estimate fits held-out frames worse.
  bool worse = false;
  /// True if the rig is the one of the calibration in use, and its depths are within the tolerated
  /// error.
  bool verified = false;
  /// True if the rig is certainly another one.
  bool contradicted = false;
};

/// Origin of the calibration in use. One that was solved from this run is not independent of the
/// estimate, so the two are not averaged.
enum class CalibrationOrigin : std::uint8_t { elsewhere, this_drive };

/// Assesses the worst additional camera of the rig. `log` holds frames newer than frame number
/// `after`, which `measured` was not solved from. Pure.
[[nodiscard]] Assessment assess(const RigCalibration& measured, const RigCalibration& current,
                                CalibrationOrigin source, const TrackLog& log, std::uint64_t after,
                                const CalibrationOptions& options, double pixel_sigma) noexcept;

/// Result of checking a solution: `open`, or the first gate that rejects it.
enum class Gate : std::uint8_t {
  open,
  not_solved,
  needs_motion,
  needs_near_structure,
  cameras_swapped,
  implausible_direction,
  implausible_rotation,
  out_of_sync,
  /// Held-out frames contradict the solution.
  does_not_fit,
  /// The solution is no better than the calibration in use, which is kept.
  no_better,
  /// The rig changed among the frames of the solve.
  rig_changed,
  /// The tracks do not determine the depth well enough yet.
  depth_unknown,
};
/// Returns the message for events.jsonl and calibrations.csv, a constant; empty for `open`.
[[nodiscard]] const char* reason(Gate gate) noexcept;

/// Returns true if a solution that this gate rejected is still a measurement of the present rig.
[[nodiscard]] constexpr bool of_this_rig(Gate gate) noexcept {
  return gate == Gate::open || gate == Gate::needs_motion || gate == Gate::needs_near_structure ||
         gate == Gate::no_better || gate == Gate::depth_unknown;
}

struct AcceptanceInput {
  const RigSolution* solution = nullptr;
  const RigCalibration* nominal = nullptr;
  /// Null if no calibration is in use.
  const RigCalibration* in_use = nullptr;
  CalibrationOrigin source = CalibrationOrigin::elsewhere;
  /// Log with the frames since the snapshot; null to skip the tests on held-out frames.
  const TrackLog* log = nullptr;
  /// Standard deviation of a tracked corner in pixels, for reference_depth_m().
  double pixel_sigma = 0.15;
  /// True if a change of the rig among the frames closes the gate. Only one change may, because a
  /// repeated false detection would close it indefinitely.
  bool may_have_changed = true;
  /// True if the solution must fit held-out frames better than `in_use`, or its depths must differ.
  bool must_be_better = true;
};

/// Returns the first gate that rejects a solution, or `open`. Pure.
[[nodiscard]] Gate check_acceptance(const AcceptanceInput& question,
                                    const CalibrationOptions& options) noexcept;

/// Returns true if the log has enough frames newer than frame number `after` to test a solution.
[[nodiscard]] bool held_out_enough(const TrackLog& log, std::uint64_t after) noexcept;

/// Ratio of the depth's sigma, at reference_depth_m() and for the worst additional camera, to
/// usable_depth_percent; a solution with more than 1 is not adopted. With fixed intrinsics only
/// noise counts.
[[nodiscard]] double depth_excess(const RigCalibration& rig, const CalibrationOptions& options,
                                  double pixel_sigma) noexcept;

/// Compares the configured focal length with the one that the images show.
///
/// An error of the focal length scales all distances, and neither epipolar lines nor a solve with
/// fixed intrinsics show it. A solve that frees every focal length within kFocalPriorSigma does, by
/// rotations and by the optical flow of straight motion with the known baseline.
///
/// `found`: such a solve. `given`: the initial calibration. Pure.
[[nodiscard]] FocalMeasurement check_focal_length(const RigSolution& found,
                                                  const RigCalibration& given) noexcept;

}  // namespace vergence::calibration
