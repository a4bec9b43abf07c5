#pragma once
#include <cstdint>

#include "app/datasets/image_file.hpp"

namespace vergence::app::detail {

/// A width and a height as a file claims them, before anything is taken for them. → ok,
/// not_an_image: nothing at all, or more than any camera gives
[[nodiscard]] inline ImageFileStatus accept_size(std::uint32_t width, std::uint32_t height,
                                                 ImageSize* size) noexcept {
  constexpr std::uint32_t kMaxSide = 1U << 15;  // px
  constexpr std::uint64_t kMaxPixels =
      std::uint64_t{1} << 27;  // what a file of a hundred bytes may make a reader take
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide ||
      std::uint64_t{width} * height > kMaxPixels)
    return ImageFileStatus::not_an_image;
  *size = {static_cast<int>(width), static_cast<int>(height)};
  return ImageFileStatus::ok;
}

}  // namespace vergence::app::detail
