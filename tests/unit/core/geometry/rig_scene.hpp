#pragma once
#include <gtest/gtest.h>

#include <vector>

#include "core/geometry/observations.hpp"
#include "tests/unit/core/geometry/random_scene.hpp"

namespace vergence::test {

struct RigScene {
  RigCalibration rig;
  Transform T_left_world;
  // True for points whose observations are the true ones with noise.
  std::vector<bool> good;
};

/// A rig of up to four 640×480 cameras, 0.5 m apart and slightly turned.
[[nodiscard]] inline RigCalibration make_rig(int cameras) {
  RigCalibration rig{.cameras = cameras};
  for (int k = 0; k < cameras; ++k) {
    Intrinsics& c = rig.intrinsics[static_cast<std::size_t>(k)];
    c.width = 640, c.height = 480, c.fx = 520 + k, c.fy = 525 - k, c.cx = 318, c.cy = 243;
    if (k > 0)
      rig.T_camera_left[static_cast<std::size_t>(k)] = {exp_so3({0.01 * k, -0.02, 0.005}),
                                                        {-0.5 * k, 0.01, 0.02}};
  }
  return rig;
}

/// Fills the table with `points` points at 2 … 40 m. A share `outliers` of them has all its pixels
/// moved by 15 px or more; a share `left_only` is seen by camera 0 alone. Noise is Gaussian,
/// sigma_px a coordinate.
[[nodiscard]] inline RigScene make_scene(Random& random, int cameras, int points, double outliers,
                                         double left_only, double noise_px, double sigma_px,
                                         RigObservationTable* table) {
  RigScene scene;
  scene.rig = make_rig(cameras);
  scene.T_left_world = random_transform(random, 1.5, 100.0);
  table->clear();
  table->set_rig(scene.rig);
  for (int i = 0; i < points; ++i) {
    const Vec3 in_left = visible_point(random, 2.0, 40.0);
    const bool good = !(random.uniform() < outliers);
    scene.good.push_back(good);
    EXPECT_TRUE(table->push(scene.T_left_world.inverse() * in_left, sigma_px));
    const int seen_by = random.uniform() < left_only ? 1 : cameras;
    for (int k = 0; k < seen_by; ++k) {
      const auto kk = static_cast<std::size_t>(k);
      const Intrinsics& c = scene.rig.intrinsics[kk];
      const Vec3 p = scene.rig.T_camera_left[kk] * in_left;
      Vec2 pixel(c.fx * p.x() / p.z() + c.cx, c.fy * p.y() / p.z() + c.cy);
      pixel.x() += noise_px * random.normal();
      pixel.y() += noise_px * random.normal();
      if (!good) {
        const double angle = random.uniform(0, 6.28), r = random.uniform(15, 200);
        pixel += r * Vec2(std::cos(angle), std::sin(angle));
      }
      table->see(k, pixel);
    }
  }
  return scene;
}

}  // namespace vergence::test
