#pragma once
#include <chrono>

#include "core/odometry/odometry.hpp"

/// Helpers shared by the sources of Odometry.
namespace vergence::odometry {

/// Problem of a frame's images; `none` if there is none.
inline Reason weakness(const ImageCheck& images, int cameras) noexcept {
  const auto all = static_cast<std::uint8_t>((1U << static_cast<unsigned>(cameras)) - 1U);
  if (images.given != all) return Reason::no_image;
  if (images.repeated) return Reason::image_repeated;
  return images.structured != all ? Reason::image_no_contrast : Reason::none;
}

/// Measures the times of a frame's stages.
class StageClock {
 public:
  explicit StageClock(FrameOutcome* out) noexcept
      : out_(out), last_(std::chrono::steady_clock::now()) {}
  /// Adds the time since the last mark to this stage, and returns it in ms.
  float mark(Stage stage) noexcept {
    const auto now = std::chrono::steady_clock::now();
    const float ms = std::chrono::duration<float, std::milli>(now - last_).count();
    out_->stage_ms[static_cast<std::size_t>(stage)] += ms;
    last_ = now;
    return ms;
  }

 private:
  FrameOutcome* out_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace vergence::odometry
