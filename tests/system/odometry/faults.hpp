#pragma once
#include "tests/system/odometry/stereo_drive.hpp"

namespace vergence::test {

/// The picture of a camera in the dark: black level and a grey level of noise.
[[nodiscard]] OwnedImage dark_image(int width, int height, std::uint64_t seed);

enum class Cover : std::uint8_t { left, right, both };

/// Frames [first, last) show only the dark on the cameras named. The pictures live in the edit.
[[nodiscard]] Edit cover(const StereoDrive& drive, Cover which, std::size_t first,
                         std::size_t last);
/// Frames [first, last) come with left and right exchanged.
[[nodiscard]] Edit swap_cameras(std::size_t first, std::size_t last);
/// Frames [first, last) never come.
[[nodiscard]] Edit leave_out(std::size_t first, std::size_t last);
/// Frames [first, last) come without the image of camera k.
[[nodiscard]] Edit take_away(int k, std::size_t first, std::size_t last);

}  // namespace vergence::test
