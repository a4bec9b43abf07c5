/// Any bytes as an image file. Entry point of libFuzzer; the unit tests call it with seeded
/// mutations.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "app/datasets/image_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence::app;
  constexpr std::size_t kMaxPixels = 1U << 20;
  constexpr std::uint8_t kFence = 0xa5;
  const std::vector<std::uint8_t> bytes(
      data, data + size);  // exactly so many: a read behind the last one is found by ASan
  ImageSize declared;
  if (check_image(bytes, &declared) != ImageFileStatus::ok) return 0;
  const auto width = static_cast<std::size_t>(declared.width),
             height = static_cast<std::size_t>(declared.height);
  if (width * height > kMaxPixels) return 0;
  const std::size_t stride = width + 8;
  std::vector<std::uint8_t> out(stride * height, kFence);
  (void)decode_grey(bytes, declared, out.data(), stride);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = width; x < stride; ++x)
      if (out[y * stride + x] != kFence) std::abort();  // rows end where the caller said
  return 0;
}
