// The covariance whose clusters are cells of the image and blocks of frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

constexpr int kPoints = 400, kCells = 6;

/// A rig that moves little, so that a point stays in its part of the image: points 6 to 30 m ahead
/// all over it, frames within a metre. Each is seen in `life` frames.
SimulatedRig small_motion(int poses, int life, Random& random,
                          const std::function<Vec2(const Vec2&)>& field_of_the_right) {
  constexpr double kNoise = 0.2;
  SimulatedRig rig;
  Intrinsics lens{.width = 1024, .height = 768, .fx = 887, .fy = 887, .cx = 511.5, .cy = 383.5};
  rig.cameras.assign(2, Camera(lens));
  rig.true_cameras = {Transform{}, Transform{exp_so3({5e-3, -8e-3, 3e-3}), {-0.7, 0.01, 0.02}}};
  for (int i = 0; i < poses; ++i) {
    const auto within = [&](double most) {
      const double x = random.uniform(-most, most), y = random.uniform(-most, most),
                   z = random.uniform(-most, most);
      return Vec3(x, y, z);
    };
    rig.true_poses.push_back(i == 0 ? Transform{} : Transform{exp_so3(within(0.02)), within(0.5)});
  }
  for (std::uint32_t j = 0; j < kPoints; ++j) {
    const double x = random.uniform(-0.55, 0.55), y = random.uniform(-0.4, 0.4);
    rig.true_points.emplace_back(Vec3(x, y, 1) * random.uniform(6, 30));
    const auto first =
        std::min(static_cast<int>(random.uniform(0, poses - life + 1)), poses - life);
    const auto last = static_cast<std::uint16_t>(first + life);
    for (auto i = static_cast<std::uint16_t>(first); i < last; ++i)
      for (std::uint8_t k = 0; k < 2; ++k) {
        Vec2 at;
        if (rig.cameras[k].project(rig.true_cameras[k] * (rig.true_poses[i] * rig.true_points[j]),
                                   &at, nullptr) != ProjectStatus::ok)
          continue;
        const double dx = kNoise * random.normal(), dy = kNoise * random.normal();
        const Vec2 seen = at + Vec2(dx, dy) + (k == 1 ? field_of_the_right(at) : Vec2::Zero());
        rig.observations.push_back({j, i, k, static_cast<float>(1 / kNoise), seen.x(), seen.y()});
      }
  }
  rig.T_camera_left = rig.true_cameras;
  rig.T_left_world = rig.true_poses;
  rig.points = rig.true_points;
  return rig;
}

/// Variance by cells over the one by tracks, mean over the five parameters that are free (t along
/// the baseline is exact).
double ratio(int poses, int life, std::uint64_t seed, const std::function<Vec2(const Vec2&)>& field,
             int n = kCells) {
  Random random(seed);
  OwnAdjuster own(capacities_for({.poses = poses, .points = kPoints}));
  BundleOptions o = with_covariance();
  const SimulatedRig start = small_motion(poses, life, random, field);
  SimulatedRig rig = start, again = start;
  const BundleResult tracks = own.adjuster.solve(rig.problem(), o);
  o.cells = n;
  const BundleResult cells = own.adjuster.solve(again.problem(), o);
  EXPECT_TRUE(tracks.has_covariance && cells.has_covariance);
  EXPECT_EQ(rig.T_camera_left[1].t, again.T_camera_left[1].t)
      << "how clusters are made changes no result";
  double sum = 0;
  for (const int i : {0, 1, 2, 4, 5})
    sum += cells.covariance_noise[1](i, i) / tracks.covariance_noise[1](i, i) / 5;
  return sum;
}

Vec2 no_field(const Vec2&) { return Vec2::Zero(); }

// A variance from 36 clusters of which five parameters have taken up theirs scatters by √(2/31) =
// 25 %, from three blocks of frames by 100 %; the mean over 40 draws by 4 % and 16 %.
TEST(BundleCells, independentErrorsGiveTheVarianceOfTracks) {
  struct Frames {
    int poses, life;
  };
  // Too few frames for blocks; tracks in all three blocks; tracks that live through all frames, so
  // that one block has them all.
  for (const auto& [poses, life] : {Frames{8, 8}, Frames{24, 8}, Frames{24, 24}}) {
    constexpr int kRuns = 40;
    double mean = 0;
    for (std::uint64_t seed = 0; seed < kRuns; ++seed)
      mean += ratio(poses, life, 200 + seed, no_field) / kRuns;
    EXPECT_GT(mean, 0.6) << poses << ' ' << life;
    EXPECT_LT(mean, 1.6) << poses << ' ' << life;
  }
}

// Errors that eleven tracks of a cell share add up there: their variance counts eleven times as
// much as by tracks. Of the field, 0.3 px in the corners and 0.1 px over the image, tracks of eight
// images see 0.1²/(0.1² + 0.2²/8), two thirds.
TEST(BundleCells, errorFieldOfTheImageWidensTheVariance) {
  constexpr int kRuns = 10;
  double mean = 0;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed)
    mean += ratio(8, 8, 300 + seed,
                  [](const Vec2& p) {
                    return Vec2(0.3 * (p.x() / 512 - 1) * (p.y() / 384 - 1) * Vec2(1, 1));
                  }) /
            kRuns;
  EXPECT_GT(mean, 2.0);
}

}  // namespace
}  // namespace vergence
