#pragma once
#include <optional>

#include "core/calibration/rig_solver.hpp"

namespace vergence::calibration {

/// A drive's tracks cut into stretches of so many moving frames, each solved with the lenses free
/// when it is full.
///
/// Ownership  `given`: whose lenses and sigmas are the priors; `start`: where the first solve
///            begins, found in these very tracks or not;
/// copied.
/// Threads    One caller; solves happen in take() and end(), some hundred milliseconds each.
///            Memory: from the arena.
class SegmentSolver {
 public:
  enum class Kind : std::uint8_t {
    alone,   // each knows nothing of the others: they can be held against each other
    joined,  // each begins with what those before it told: the last one is the drive's
  };
  SegmentSolver(Kind kind, const RigCalibration& given, const RigCalibration& start,
                std::size_t frames, const CalibrationOptions& options,
                const MonitorOptions& monitor, std::size_t features, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(const CalibrationOptions& options,
                                                 const MonitorOptions& monitor, int cameras,
                                                 std::size_t features) noexcept;

  /// Takes over the frames of `tracks` that are newer than those taken before. A value: a stretch
  /// was full and is solved.
  [[nodiscard]] std::optional<RigSolution> take(const TrackLog& tracks) noexcept;
  /// The drive is over: what is left is solved if it is enough; kind `joined`: also less than a
  /// stretch counts.
  [[nodiscard]] std::optional<RigSolution> end() noexcept;
  [[nodiscard]] std::uint64_t frames() const noexcept { return taken_; }

 private:
  [[nodiscard]] std::optional<RigSolution> solve() noexcept;

  Kind kind_;
  CalibrationOptions options_;
  RigCalibration given_, start_, known_;
  bool any_known_ = false;
  std::size_t frames_;
  RigSolver solver_;
  std::uint64_t newest_ = 0, taken_ = 0;
  bool any_ = false;
};

}  // namespace vergence::calibration
