#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "app/checkerboard/board_detector.hpp"
#include "core/camera/camera.hpp"

namespace vergence::test {

/// Draws a board as one camera of a rig sees it: black and white squares with a white margin on
/// grey. Edges are ramps two pixels wide, as a lens makes them; sampled steps would put every edge
/// somewhere else.
class BoardPainter {
 public:
  explicit BoardPainter(const Intrinsics& lens) : lens_(lens) {
    const Camera camera(lens);
    for (int y = 0; y < lens.height; ++y)
      for (int x = 0; x < lens.width; ++x) {
        Vec3 ray(0, 0, 1);
        (void)camera.unproject({static_cast<double>(x), static_cast<double>(y)}, &ray);
        rays_.push_back(ray);
      }
  }

  /// Rows of `width` bytes.
  [[nodiscard]] std::vector<std::uint8_t> paint(const app::BoardPattern& board,
                                                const Transform& T_camera_board) const {
    const Transform T_board_camera = T_camera_board.inverse();
    std::vector<std::uint8_t> pixels;
    pixels.reserve(rays_.size());
    for (const Vec3& ray : rays_)
      pixels.push_back(
          static_cast<std::uint8_t>(shade(board, T_board_camera.t, T_board_camera.R * ray) + 0.5));
    return pixels;
  }

 private:
  [[nodiscard]] double shade(const app::BoardPattern& board, const Vec3& eye,
                             const Vec3& ray) const {
    constexpr double kGrey = 110, kMiddle = 125, kContrast = 95;
    // Rays have z = 1 in the camera.
    const double depth = -eye.z() / ray.z();
    if (!(depth > 0)) return kGrey;
    const double x = (eye.x() + depth * ray.x()) / board.square,
                 y = (eye.y() + depth * ray.y()) / board.square;
    if (x < -2 || y < -2 || x > board.columns + 1 || y > board.rows + 1) return kGrey;
    // Size of a pixel in squares.
    const double pixel = depth / (lens_.fx * board.square);
    if (x < -1 || y < -1 || x > board.columns || y > board.rows) return kMiddle + kContrast;
    // The square right of and below the first corner is white.
    return kMiddle + kContrast * wave(x, pixel) * wave(y, pixel);
  }
  /// 1 in squares of even number, -1 in the others, a ramp of half width `pixel` between.
  static double wave(double x, double pixel) {
    const double edge = std::round(x), across = std::clamp((x - edge) / pixel, -1.0, 1.0);
    return (static_cast<int>(edge) % 2 == 0 ? 1 : -1) * std::sin(0.5 * M_PI * across);
  }

  Intrinsics lens_;
  std::vector<Vec3> rays_;
};

}  // namespace vergence::test
