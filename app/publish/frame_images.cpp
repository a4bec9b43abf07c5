#include "app/publish/frame_images.hpp"

#include <cstring>

namespace vergence::app {

bool FrameImages::copy(const RigFrame& frame) noexcept {
  if (owner_.load(std::memory_order_acquire) != Owner::estimator) return false;
  for (std::size_t k = 0; k < kImages; ++k) {
    images_[k] = {};
    const ImageView image = static_cast<int>(k) < frame.cameras ? frame.images[k] : ImageView{};
    const auto width = static_cast<std::size_t>(image.width);
    if (image.empty() || width * static_cast<std::size_t>(image.height) > pixels_[k].size())
      continue;
    std::uint8_t* out = pixels_[k].data();
    for (int y = 0; y < image.height; ++y, out += width) std::memcpy(out, image.row(y), width);
    images_[k] = {pixels_[k].data(), image.width, image.height, image.width};
  }
  frame_ = frame.number;
  stamp_ = frame.stamp;
  owner_.store(Owner::copy, std::memory_order_relaxed);
  return true;
}

void FrameImages::want(std::size_t image_bytes) {
  if (owner_.load(std::memory_order_acquire) != Owner::none) return;
  for (std::vector<std::uint8_t>& pixels : pixels_) pixels.resize(image_bytes);
  owner_.store(Owner::estimator, std::memory_order_release);
}

}  // namespace vergence::app
