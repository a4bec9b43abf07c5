#pragma once
#include <array>

#include "core/calibration/options.hpp"
#include "core/calibration/rig_solver.hpp"
#include "core/calibration/track_log.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// How well a calibration fits frames that it was not solved from: distances of matches across to their epipolar lines.
struct HeldOut {
  int frames = 0;
  double median_px = 0;  // of the frames' medians
};

/// Frames newer than `after`. At most the newest kHeldOutFrames, and of each at most kHeldOutMatches. Threads pure.
inline constexpr std::size_t kHeldOutFrames = 12, kHeldOutMatches = 150;
[[nodiscard]] HeldOut held_out(const TrackLog& log, std::uint64_t after, const RigCalibration& rig) noexcept;

/// Whether `better` fits those frames better than `worse` by more than chance: mean over frames of the difference of medians against twice
/// its standard error.
[[nodiscard]] bool fits_better(const TrackLog& log, std::uint64_t after, const RigCalibration& better,
                               const RigCalibration& worse) noexcept;

enum class Gate : std::uint8_t {
  open,
  not_solved,
  sigmas_too_large,
  needs_motion,
  needs_near_structure,
  cameras_swapped,
  implausible_direction,
  implausible_rotation,
  out_of_step,
  does_not_fit,  // frames not in the solve contradict it
  no_better,     // than the calibration in use: that one is kept
};
/// The sentence for events and calibrations.csv; empty for `open`.
[[nodiscard]] const char* reason(Gate gate) noexcept;

struct GateQuestion {
  const RigSolution* solution = nullptr;
  const RigCalibration* nominal = nullptr;
  const RigCalibration* in_use = nullptr;  // null: there is none
  const TrackLog* log = nullptr;           // with the frames since the snapshot
  bool window_full = false;                // max_frames were used, or no more will come: three times the sigmas are enough
};

/// METHOD §4: what stands between a solution and its use. Threads pure.
[[nodiscard]] Gate ask_gates(const GateQuestion& question, const CalibrationOptions& options) noexcept;

/// How many times the wanted sigmas the worst of the solution is; ≤ 1: enough.
[[nodiscard]] double sigma_excess(const RigCalibration& rig, const CalibrationOptions& options) noexcept;

}  // namespace vergence::calibration
