#pragma once
#include <cstddef>

#include "core/types/time.hpp"
#include "tests/support/rendered_drive.hpp"
#include "tests/unit/core/features/texture.hpp"

namespace vergence::test {

/// A stereo drive in memory with its ground truth: T_reference_left of every frame, in any world.
struct StereoDrive {
  RigCalibration rig;
  std::vector<Stamp> stamps;
  std::vector<std::array<features::test::Image, 2>> pairs;
  /// T_reference_left of every frame.
  std::vector<Transform> truth;

  [[nodiscard]] std::size_t size() const noexcept { return pairs.size(); }
  /// Frame i as a camera driver delivers it; the images live as long as the drive.
  [[nodiscard]] RigFrame frame(std::size_t i) const;
};

/// Frames [0, frames) of a rendered drive of two cameras.
[[nodiscard]] StereoDrive render(const RenderedDriveOptions& options, std::size_t frames);

/// 640×480 px, 60° wide, radtan lenses, 0.75 m baseline with the right camera turned a little.
[[nodiscard]] RigCalibration distorted_rig();
/// The short drive at 9 m/s from `from_s` on, 20 pairs a second.
[[nodiscard]] RenderedDriveOptions brief_options(const RigCalibration& rig, double from_s);
/// 12 s of it through distorted_rig(): standing, starting and a corner. Rendered once a process.
[[nodiscard]] const StereoDrive& brief_drive();

}  // namespace vergence::test
