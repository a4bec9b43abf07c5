#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "app/calibration/board_pattern.hpp"
#include "core/camera/camera.hpp"
#include "core/math/se3.hpp"

namespace vergence::test {

/// A flat board of black and white as it is printed.
struct PrintedBoard {
  cv::Mat picture;  // with a margin; around it all is grey
  double scale;     // px a metre
  double x, y;      // px of the board's origin
  bool y_up = false;

  /// As a camera sees it: each pixel is the mean over a grid of points within it.
  [[nodiscard]] std::vector<std::uint8_t> paint(const Intrinsics& lens,
                                                const Transform& T_camera_board) const {
    constexpr int kSteps = 4;
    const Camera camera(lens);
    const Transform T_board_camera = T_camera_board.inverse();
    std::vector<std::uint8_t> pixels;
    for (int v = 0; v < lens.height; ++v)
      for (int u = 0; u < lens.width; ++u) {
        Vec3 ray(0, 0, 1), right(0, 0, 1), below(0, 0, 1);
        (void)camera.unproject({u - 0.0, v - 0.0}, &ray);
        (void)camera.unproject({u + 1.0, v - 0.0}, &right);
        (void)camera.unproject({u - 0.0, v + 1.0}, &below);
        double sum = 0;
        for (int i = 0; i < kSteps * kSteps; ++i) {
          const double along = (i % kSteps + 0.5) / kSteps - 0.5,
                       down = (i / kSteps + 0.5) / kSteps - 0.5;
          const Vec3 d =
              T_board_camera.R * Vec3(ray + along * (right - ray) + down * (below - ray));
          const double depth = -T_board_camera.t.z() / d.z();
          sum += grey(depth > 0 ? Vec3(T_board_camera.t + depth * d) : Vec3(1e6, 1e6, 0));
        }
        pixels.push_back(static_cast<std::uint8_t>(sum / (kSteps * kSteps) + 0.5));
      }
    return pixels;
  }

 private:
  [[nodiscard]] double grey(const Vec3& p) const {
    const double u = x + scale * p.x(), v = y + (y_up ? -scale : scale) * p.y();
    if (!(u >= 0 && v >= 0 && u < picture.cols && v < picture.rows)) return 110;
    return picture.at<std::uint8_t>(static_cast<int>(v), static_cast<int>(u)) > 127 ? 220 : 30;
  }
};

// In drawn images cornerSubPix is off by a tenth of a pixel here and there, as for checkerboards; a
// wrong index would be a side of a tag or a square, 20 px.
inline void expect_corners(const app::BoardCorners& found, const RigCalibration& rig,
                           const app::BoardPattern& board, const Transform& T) {
  Vec2 sum = Vec2::Zero();
  for (const app::BoardCorner& c : found) {
    Vec2 truth;
    ASSERT_EQ(Camera(rig.intrinsics[0]).project(T * board.corner(c.index), &truth, nullptr),
              ProjectStatus::ok);
    EXPECT_LT((c.pixel - truth).norm(), 0.3) << c.index << ": " << (c.pixel - truth).transpose();
    sum += c.pixel - truth;
  }
  EXPECT_LT(sum.norm(), 0.05 * static_cast<double>(found.size()));
}

}  // namespace vergence::test
