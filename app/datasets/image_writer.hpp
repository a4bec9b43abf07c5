#pragma once
#include <filesystem>

#include "core/types/image.hpp"

namespace vergence::app {

/// Writes an 8-bit grey PNG, optimised for speed, because several images per second are written.
/// Throws InputError on failure.
void write_png(const std::filesystem::path& file, const ImageView& image);

}  // namespace vergence::app
