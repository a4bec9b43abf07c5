#pragma once
#include <cstdint>
#include <vector>

#include "core/camera/camera.hpp"
#include "core/math/se3.hpp"

namespace vergence::test {

constexpr double kPaintedWhite = 220, kPaintedBlack = 30, kPaintedGrey = 110;

/// A flat board as a camera sees it: each pixel is the mean of `grey(x, y)` (metres on the board)
/// over a grid of points within it.
template <class Grey>
std::vector<std::uint8_t> paint_board(const Intrinsics& lens, const Transform& T_camera_board,
                                      const Grey& grey) {
  constexpr int kSteps = 4;
  const Camera camera(lens);
  const Transform T_board_camera = T_camera_board.inverse();
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      Vec3 ray(0, 0, 1), right(0, 0, 1), below(0, 0, 1);
      (void)camera.unproject({x - 0.0, y - 0.0}, &ray);
      (void)camera.unproject({x + 1.0, y - 0.0}, &right);
      (void)camera.unproject({x - 0.0, y + 1.0}, &below);
      double sum = 0;
      for (int i = 0; i < kSteps * kSteps; ++i) {
        const double along = (i % kSteps + 0.5) / kSteps - 0.5,
                     down = (i / kSteps + 0.5) / kSteps - 0.5;
        const Vec3 d = T_board_camera.R * Vec3(ray + along * (right - ray) + down * (below - ray));
        const double depth = -T_board_camera.t.z() / d.z();
        const Vec3 p = T_board_camera.t + depth * d;
        sum += depth > 0 ? grey(p.x(), p.y()) : kPaintedGrey;
      }
      pixels.push_back(static_cast<std::uint8_t>(sum / (kSteps * kSteps) + 0.5));
    }
  return pixels;
}

}  // namespace vergence::test
