#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// Passes copies of one frame's left and right images from the estimator's thread to one reader, on
/// request only.
///
/// Threads  The estimator's thread, which is sealed, calls copy(), copying() and finish(): a memcpy
///          of two images if a frame is requested, else one atomic load. The reader makes the other
///          calls. A flag states the owner of the memory; no thread waits.
/// Memory   Two images, allocated by the first want().
class FrameImages {
 public:
  /// Copies the images if requested. If true, finish() must follow, now or later.
  bool copy(const RigFrame& frame) noexcept {
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
  /// True while a copy waits for finish().
  [[nodiscard]] bool copying() const noexcept {
    return owner_.load(std::memory_order_relaxed) == Owner::copy;
  }
  void finish() noexcept { owner_.store(Owner::reader, std::memory_order_release); }

  /// Requests the next frame unless one is requested or available. `image_bytes` is the size of the
  /// largest camera; larger images are skipped.
  void want(std::size_t image_bytes) {
    if (owner_.load(std::memory_order_acquire) != Owner::none) return;
    for (std::vector<std::uint8_t>& pixels : pixels_) pixels.resize(image_bytes);
    owner_.store(Owner::estimator, std::memory_order_release);
  }
  /// True if a frame is available; it stays until done().
  [[nodiscard]] bool ready() const noexcept {
    return owner_.load(std::memory_order_acquire) == Owner::reader;
  }
  void done() noexcept { owner_.store(Owner::none, std::memory_order_release); }
  [[nodiscard]] std::uint64_t frame() const noexcept { return frame_; }
  [[nodiscard]] Stamp stamp() const noexcept { return stamp_; }
  /// Image without padding; empty if the camera had none.
  [[nodiscard]] ImageView image(std::size_t camera) const noexcept { return images_[camera]; }

  static constexpr std::size_t kImages = 2;

 private:
  enum class Owner : std::uint8_t { none, estimator, copy, reader };

  std::atomic<Owner> owner_{Owner::none};
  std::uint64_t frame_ = 0;
  Stamp stamp_{};
  std::array<std::vector<std::uint8_t>, kImages> pixels_{};
  // Views of pixels_.
  std::array<ImageView, kImages> images_{};
};

}  // namespace vergence::app
