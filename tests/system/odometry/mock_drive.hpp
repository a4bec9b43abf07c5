#pragma once
#include "drivers/mock/world/drive.hpp"
#include "tests/system/odometry/stereo_drive.hpp"

namespace vergence::test {

/// Part of a drive through the rendered suburb: 640×480 px, 60° wide, radtan lenses, 0.75 m
/// baseline with the right camera turned a little, sensor noise, 20 pairs a second.
[[nodiscard]] StereoDrive render_drive(const mock::DriveOptions& options, Duration from,
                                       std::size_t frames);
/// Renders through another rig's two lenses.
[[nodiscard]] StereoDrive render_drive(const mock::DriveOptions& options, Duration from,
                                       std::size_t frames, const RigCalibration& rig);

/// Standing, starting and a corner: rendered once a process.
[[nodiscard]] const StereoDrive& brief_drive();
/// Standing still, with the sensor's noise only.
[[nodiscard]] const StereoDrive& still_drive();

}  // namespace vergence::test
