#pragma once
#include <chrono>

#include "core/odometry/odometry.hpp"

/// Helpers shared by the sources of Odometry.
namespace vergence::odometry::detail {

inline constexpr int kNearEnough = 10;  // near points that keep the scale
inline constexpr double kRigidShare =
    0.4;  // of the points found that must agree: below it something else moves

/// The problem of a frame's images themselves; `none` if there is none.
inline Reason weakness(const ImageCheck& images, int cameras) noexcept {
  const auto all = static_cast<std::uint8_t>((1U << static_cast<unsigned>(cameras)) - 1U);
  if (images.given != all) return Reason::no_image;
  if (images.repeated) return Reason::image_repeated;
  return images.structured != all ? Reason::image_no_contrast : Reason::none;
}

/// Times of a frame's stages.
class StageClock {
 public:
  explicit StageClock(FrameOutcome* out) noexcept
      : out_(out), last_(std::chrono::steady_clock::now()) {}
  /// Adds the time since the last mark to this stage, and returns it, ms.
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

}  // namespace vergence::odometry::detail
