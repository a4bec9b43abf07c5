/// Any bytes as an image file. Entry point of libFuzzer; the unit tests call it with seeded
/// mutations.
#include <cstdlib>

#include "app/datasets/image_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence::app;
  constexpr std::size_t kMaxPixels = 1U << 20;
  constexpr std::uint8_t kFence = 0xa5;
  // The exact size lets ASan find a read beyond the last byte.
  const std::vector<std::uint8_t> bytes(data, data + size);
  ImageSize declared;
  if (read_image_size(bytes, &declared) != ImageFileStatus::ok) return 0;
  const auto width = static_cast<std::size_t>(declared.width),
             height = static_cast<std::size_t>(declared.height);
  if (width * height > kMaxPixels) return 0;
  const std::size_t stride = width + 8;
  std::vector<std::uint8_t> out(stride * height, kFence);
  (void)decode_grey(bytes, declared, out.data(), stride);
  // Rows must end at the given width.
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = width; x < stride; ++x)
      if (out[y * stride + x] != kFence) std::abort();
  return 0;
}
