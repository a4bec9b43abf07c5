#pragma once
#include <cstdint>
#include <optional>
#include <span>

namespace vergence::app {

/// The orientation that a JPEG's EXIF block asks viewers for, 1 (as it is) to 8; nothing: it asks
/// for none. Images are read as they are in any case: a camera's pixels and its calibration belong
/// together.
///
/// Layout: JPEG's marker segments (ITU-T T.81 B.1); APP1 "Exif", a TIFF header and its first
/// directory, tag 0x0112 (CIPA DC-008 4.6.4).
[[nodiscard]] std::optional<int> exif_orientation(std::span<const std::uint8_t> jpeg) noexcept;

}  // namespace vergence::app
