#pragma once
#include <array>

#include "core/calibration/options.hpp"
#include "core/calibration/rig_solver.hpp"
#include "core/calibration/track_log.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// How well a calibration fits frames that it was not solved from: distances of stereo matches to
/// their epipolar lines.
struct HeldOut {
  int frames = 0;
  double median_px = 0;  // of the frames' medians
};

/// Frames newer than `after`. At most the newest kHeldOutFrames, and of each at most
/// kHeldOutMatches. Of more than one further camera the one that fits worst, px of its own. Threads
/// pure.
inline constexpr std::size_t kHeldOutFrames = 12, kHeldOutMatches = 150;
[[nodiscard]] HeldOut held_out(const TrackLog& log, std::uint64_t after,
                               const RigCalibration& rig) noexcept;

/// Whether `better` fits those frames better than `worse` by more than chance: mean over frames of
/// the difference of medians against `chance` of its standard errors; true, too, where hardly a
/// frame can say. Of more than one further camera the sum of what each gains: a camera that was
/// knocked tells, and another that a shorter drive holds a little less well does not outweigh it.
/// Threads pure.
inline constexpr double kChance = 2.0;
inline constexpr double kRareChance = 3.0;  // of a question that every solve asks
[[nodiscard]] bool fits_better(const TrackLog& log, std::uint64_t after,
                               const RigCalibration& better, const RigCalibration& worse,
                               double chance = kChance) noexcept;

/// What a drive's own measurement of the rig says of the calibration in use (METHOD §7).
///
/// The difference d of their depths, at the depth that calibrations are judged at, is evidence
/// between two hypotheses: the rig is the one of the claim, which is off by no more than a
/// calibration of its kind is (sigma m), or it is another one (sigma M). With s, the
/// sigma of the measurement,
///
///     log_odds = log N(d; 0, m² + s²) − log N(d; 0, M² + s²).
struct Assessment {
  double depth_m = 0;             // where it is judged: reference_depth_m()
  double sigma_percent = 0;       // of the measured calibration's depth there, 1 sigma
  double difference_percent = 0;  // of the claimed one from the measured, root mean over the image
  double log_odds = 0;            // that the rig is the one of the claim
  bool nearer = false;            // the measured one is surely nearer to the rig in depth
  bool better = false;     // it should be used instead: it is nearer and explains frames that were
                           // not used no worse, or it does better where the claim misses them
  bool worse = false;      // it explains them worse
  bool confirmed = false;  // the rig is the one of the claim, whose depths hold to the tolerated
                           // error
  bool contradicted = false;  // the rig certainly is another one
};

/// Where a claim is from: the sigma of one that was solved from this drive's frames, which the
/// measurement rests on, too, is no evidence beside it.
enum class ClaimSource : std::uint8_t { elsewhere, this_drive };

/// The worst of the rig's further cameras. `log` with frames after `after` that `measured` does not
/// rest on. Threads pure.
[[nodiscard]] Assessment assess(const RigCalibration& measured, const RigCalibration& claimed,
                                ClaimSource source, const TrackLog& log, std::uint64_t after,
                                const CalibrationOptions& options, double pixel_sigma) noexcept;

enum class Gate : std::uint8_t {
  open,
  not_solved,
  sigmas_too_large,
  needs_motion,
  needs_near_structure,
  cameras_swapped,
  implausible_direction,
  implausible_rotation,
  out_of_sync,
  does_not_fit,   // frames not in the solve contradict it
  no_better,      // than the calibration in use: that one is kept
  rig_changed,    // among the very frames it was solved from
  depth_unknown,  // with the lenses free the tracks do not hold the depth yet
};
/// The message for events and calibrations.csv; empty for `open`.
[[nodiscard]] const char* reason(Gate gate) noexcept;

/// Whether a solution that came to this gate is at least one of the rig that the images are of now.
[[nodiscard]] constexpr bool of_this_rig(Gate gate) noexcept {
  switch (gate) {
    case Gate::not_solved:
    case Gate::cameras_swapped:
    case Gate::implausible_direction:
    case Gate::implausible_rotation:
    case Gate::out_of_sync:
    case Gate::does_not_fit:
    case Gate::rig_changed:
      return false;
    case Gate::open:
    case Gate::sigmas_too_large:
    case Gate::needs_motion:
    case Gate::needs_near_structure:
    case Gate::no_better:
    case Gate::depth_unknown:
      return true;
  }
  return false;
}

struct AcceptanceInput {
  const RigSolution* solution = nullptr;
  const RigCalibration* nominal = nullptr;
  const RigCalibration* in_use = nullptr;  // null: there is none
  const TrackLog* log =
      nullptr;  // with the frames since the snapshot; null: there are none to hold it against
  bool lenses = false;        // they were free: depth is judged by their joint covariance, not the
                              // transform's single sigmas
  double pixel_sigma = 0.15;  // px, of a tracked corner: reference_depth_m()
  bool may_have_changed = true;  // a change of the rig among the frames used closes the gate; once,
                                 // or a wrong one would for ever
  bool must_be_better = true;    // than `in_use`, on frames that were not used
  bool window_full =
      false;  // max_frames were used, or no more will come: three times the sigmas are enough
};

/// METHOD §4: what stands between a solution and its use. Threads pure.
[[nodiscard]] Gate check_acceptance(const AcceptanceInput& question,
                                    const CalibrationOptions& options) noexcept;

/// Whether the log has as many frames after that number as it takes to hold a solution against.
[[nodiscard]] bool held_out_enough(const TrackLog& log, std::uint64_t after) noexcept;

/// How many times the wanted sigmas the worst of the solution is; ≤ 1: enough.
[[nodiscard]] double sigma_excess(const RigCalibration& rig,
                                  const CalibrationOptions& options) noexcept;

}  // namespace vergence::calibration
