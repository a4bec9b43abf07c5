#pragma once
#include <cstdint>
#include <vector>

#include "core/types/image.hpp"

namespace vergence::app {

/// An 8-bit grey image as a PNG file in *file, whose capacity is reused: level 1 of zlib and the
/// filter Sub, quick rather than small. Takes heap. False: the image is empty or libpng failed.
///
/// Threads  Any number at once. Errors: std::bad_alloc.
[[nodiscard]] bool encode_png(const ImageView& image, std::vector<std::uint8_t>* file);

}  // namespace vergence::app
