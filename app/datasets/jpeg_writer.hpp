#pragma once
#include <string>

#include "core/types/image.hpp"

namespace vergence::app {

/// A grey JPEG in memory, quickly: what a live view shows. `quality`: 1 to 100. Empty: the library
/// refuses it (no pixels, no memory).
[[nodiscard]] std::string grey_jpeg(const ImageView& image, int quality);

}  // namespace vergence::app
