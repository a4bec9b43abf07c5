#pragma once
#include <filesystem>
#include <string>

#include "core/types/image.hpp"

namespace vergence::app {

/// Writes an 8-bit grey PNG, optimised for speed, because several images per second are written.
/// Throws InputError on failure.
void write_png(const std::filesystem::path& file, const ImageView& image);

/// Encodes a grey JPEG in memory for the live view, optimised for speed. `quality` is 1 to 100.
/// Empty if the library fails (no pixels, no memory).
[[nodiscard]] std::string grey_jpeg(const ImageView& image, int quality);

}  // namespace vergence::app
