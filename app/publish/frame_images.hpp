#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// Hands copies of one frame's left and right images from the estimator's thread to one reader,
/// only when the reader has asked for them.
///
/// Threads  copy(), copying(), finish(): the estimator's, sealed; a memcpy of two images when a
///          frame is wanted, one load of a flag when not. The rest: the reader's. A flag says whose
///          the memory is; neither thread waits.
/// Memory   Two images, taken by the first want().
class FrameImages {
 public:
  /// Copies the images if they are wanted. True: finish() hands them over, now or later.
  bool copy(const RigFrame& frame) noexcept;
  /// A copy waits for finish().
  [[nodiscard]] bool copying() const noexcept {
    return owner_.load(std::memory_order_relaxed) == Owner::copy;
  }
  void finish() noexcept { owner_.store(Owner::reader, std::memory_order_release); }

  /// Asks for the next frame, if none is asked for or here. `image_bytes`: of the largest camera;
  /// larger images are left out.
  void want(std::size_t image_bytes);
  /// A frame is here and stays until done().
  [[nodiscard]] bool ready() const noexcept {
    return owner_.load(std::memory_order_acquire) == Owner::reader;
  }
  void done() noexcept { owner_.store(Owner::none, std::memory_order_release); }
  [[nodiscard]] std::uint64_t frame() const noexcept { return frame_; }
  [[nodiscard]] Stamp stamp() const noexcept { return stamp_; }
  /// Without padding; empty where the camera gave none.
  [[nodiscard]] ImageView image(std::size_t camera) const noexcept { return images_[camera]; }

  static constexpr std::size_t kImages = 2;

 private:
  enum class Owner : std::uint8_t { none, estimator, copy, reader };

  std::atomic<Owner> owner_{Owner::none};
  std::uint64_t frame_ = 0;
  Stamp stamp_{};
  std::array<std::vector<std::uint8_t>, kImages> pixels_{};
  std::array<ImageView, kImages> images_{};  // of pixels_
};

}  // namespace vergence::app
