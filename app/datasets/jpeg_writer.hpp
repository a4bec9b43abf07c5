#pragma once
#include <string>

#include "core/types/image.hpp"

namespace vergence::app {

/// Encodes a grey JPEG in memory for the live view, optimised for speed. `quality` is 1 to 100.
/// Empty if the library fails (no pixels, no memory).
[[nodiscard]] std::string grey_jpeg(const ImageView& image, int quality);

}  // namespace vergence::app
