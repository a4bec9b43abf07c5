#pragma once
#include <filesystem>

#include "core/types/image.hpp"

namespace vergence::app {

/// An 8-bit grey PNG, quickly rather than small: images come several times a second. Neither image
/// nor file is changed by another program meanwhile. InputError: it cannot be written.
void write_png(const std::filesystem::path& file, const ImageView& image);

}  // namespace vergence::app
