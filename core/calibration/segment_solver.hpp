#pragma once
#include <optional>

#include "core/calibration/rig_solver.hpp"

namespace vergence::calibration {

/// Splits the tracks of a run into stretches of `frames` moving frames and solves each when it is
/// full.
///
/// Ownership  `given`, whose intrinsics are the priors, and `start`, the initial values of the
///            first solve, are copied.
/// Threads    One caller; solves run in add() and end(), some hundred milliseconds each.
/// Memory     From the arena.
class SegmentSolver {
 public:
  enum class Kind : std::uint8_t {
    /// Each solve is independent of the others, so that they can be compared.
    alone,
    /// The posterior of each solve is the prior of the next, so that the last one covers all
    /// frames.
    joined,
  };
  SegmentSolver(Kind kind, const RigCalibration& given, const RigCalibration& start,
                std::size_t frames, const CalibrationOptions& options,
                const MonitorOptions& monitor, std::size_t features, Arena& arena);

  /// Adds the frames of `tracks` that are newer than those added before. Returns the solution if
  /// that completed a stretch.
  [[nodiscard]] std::optional<RigSolution> add(const TrackLog& tracks) noexcept;
  /// Call after the last frame: solves the remaining frames if they are at least
  /// options.min_frames.
  [[nodiscard]] std::optional<RigSolution> end() noexcept;
  [[nodiscard]] std::uint64_t frames() const noexcept { return taken_; }

 private:
  [[nodiscard]] std::optional<RigSolution> solve() noexcept;

  Kind kind_;
  CalibrationOptions options_;
  RigCalibration given_, start_;
  // Posterior of the stretches solved so far, if they are joined.
  std::optional<RigCalibration> known_;
  std::size_t frames_;
  RigSolver solver_;
  // Number of the first frame that was not added yet, and of frames added.
  std::uint64_t next_ = 0, taken_ = 0;
};

}  // namespace vergence::calibration
