#include "drivers/mock/world/renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "drivers/mock/world/detail/town.hpp"
#include "tests/support/simd_targets.hpp"

namespace vergence::mock {
namespace {

// One grey level in a picture of two levels 150 apart moves an edge by 1/150 px; rounding to 8 bits
// moves it by half of that on each of the two pixels an edge spans.
constexpr double kRounding = 1.0 / 150;

/// A dark wall and bright plates in front of it; the camera looks along +y from the origin.
struct Plates {
  std::unique_ptr<Scene> scene = std::make_unique<Scene>();
  WorldOptions options;
  SceneBuilder builder{options, scene.get()};

  Plates() {
    for (const float value : {0.1F, 0.8F}) {
      const Canvas c(3, 3, 1, 1, value);
      scene->materials.push_back({scene->atlas.add(c), {}, 8, 8, {}});
    }
    plate(-400, 400, -400, 400, 60, 0);
  }
  void plate(double x0, double x1, double z0, double z1, double y, int material) {
    builder.begin();
    builder.textured_quad(
        std::array<Vec3, 4>{Vec3(x0, y, z0), Vec3(x1, y, z0), Vec3(x1, y, z1), Vec3(x0, y, z1)},
        material, 1.0F, 1, 1);
    builder.end();
  }
  [[nodiscard]] std::shared_ptr<const World> world() {
    return std::make_shared<const World>(options, std::move(scene));
  }
};

/// Camera axes in enu: right = east, down = −up, forward = north.
Transform looking_north(const Vec3& position) {
  Mat3 R;
  R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return {R, -(R * position)};
}

Intrinsics lens(bool distorted) {
  Intrinsics k{.width = 320, .height = 240, .fx = 290, .fy = 285, .cx = 158.3, .cy = 121.7};
  if (distorted) k.distortion = {-0.28, 0.08, 0.0007, -0.0004, 0};
  return k;
}

struct RenderedImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] int at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y * width + x)];
  }
};

RenderedImage render(Renderer* renderer, const Transform& T_camera_enu, const RenderRequest& shot) {
  const Intrinsics& k = renderer->camera().intrinsics();
  RenderedImage p{k.width, k.height,
                  std::vector<std::uint8_t>(static_cast<std::size_t>(k.width * k.height))};
  renderer->render(T_camera_enu, shot, p.pixels.data(), k.width);
  return p;
}

RenderRequest clean() { return {.vignetting = 0}; }

/// Where the brightness from x0 to x1 of a row steps between `left` and `right`: the edge that
/// would give this sum.
double edge_position(const RenderedImage& p, int y, int x0, int x1, double left, double right) {
  double sum = 0;
  for (int x = x0; x < x1; ++x) sum += (p.at(x, y) - right) / (left - right);
  return x0 - 0.5 + sum;
}

/// Where a line that goes upwards in the world is seen in a row, by bisection on the model's
/// projection.
template <class Line>
Vec2 seen_in_row(const Camera& camera, const Transform& T_camera_enu, int row, double lo, double hi,
                 const Line& at_height) {
  Vec2 pixel(0, 0);
  for (int i = 0; i < 60; ++i) {
    const double mid = 0.5 * (lo + hi);
    EXPECT_EQ(camera.project(T_camera_enu * at_height(mid), &pixel, nullptr), ProjectStatus::ok);
    (pixel.y() > row ? lo : hi) = mid;
  }
  return pixel;
}

TEST(Renderer, edgesLieWhereTheLensModelPutsThem) {
  for (const bool distorted : {false, true}) {
    Plates scene;
    scene.plate(-1.2, 1.7, -1.1, 1.4, 6.0, 1);
    const Camera camera(lens(distorted));
    Renderer renderer(scene.world(), camera);
    for (double shift = 0; shift < 0.03;
         // A pixel at 6 m is 0.02 m, so the shifts cover every sub-pixel phase.
         shift += 0.0041) {
      const Transform T_camera_enu = looking_north({shift, 0, 0});
      const RenderedImage p = render(&renderer, T_camera_enu, clean());
      const double dark = p.at(2, 120), bright = p.at(160, 120);
      ASSERT_GT(bright - dark, 150);
      for (const double plate_x : {-1.2, 1.7}) {
        for (int y = 90; y < 160; y += 7) {
          const Vec2 pixel = seen_in_row(camera, T_camera_enu, y, -1.1, 1.4,
                                         [&](double z) { return Vec3(plate_x, 6.0, z); });
          const int x = static_cast<int>(pixel.x());
          const double measured = plate_x < 0 ? edge_position(p, y, x - 5, x + 6, dark, bright)
                                              : edge_position(p, y, x - 5, x + 6, bright, dark);
          // A ray at a pixel's centre stands for the pixel: exact for an undistorted straight edge,
          // and under distortion up to the change of the local scale across the ramp, some 1e-3 px.
          EXPECT_NEAR(measured, pixel.x(), kRounding + 3e-3)
              << "row " << y << (distorted ? " distorted" : "");
        }
      }
    }
  }
}

TEST(Renderer, stripThinnerThanAPixelKeepsItsArea) {
  Plates scene;
  // The width is 0.3 px at 8 m.
  const double width = 0.3 * 8.0 / 290;
  scene.plate(0, width, -3, 3, 8.0, 1);
  // The wide plate gives the brightness.
  scene.plate(-2, -0.5, -3, 3, 8.0, 1);
  Renderer renderer(scene.world(), Camera(lens(false)));
  for (double shift = 0; shift < 0.03; shift += 0.0037) {
    const RenderedImage p = render(&renderer, looking_north({shift, 0, 0}), clean());
    const double step = p.at(110, 120) - p.at(2, 120);
    ASSERT_GT(step, 150);
    double sum = 0;
    for (int x = 150; x < 180; ++x) sum += p.at(x, 120) - p.at(2, 120);
    // Three pixels and the step are rounded.
    EXPECT_NEAR(sum, 0.3 * step, 2.0) << shift;
  }
}

TEST(Renderer, noiseHasTheStatedVarianceAndSeed) {
  Plates scene;
  scene.plate(-100, 100, -100, 100, 6.0, 1);
  Renderer renderer(scene.world(), Camera(lens(false)));
  const Transform T = looking_north({0, 0, 0});
  RenderRequest shot = clean();
  shot.shot_noise = 0.03;
  shot.read_noise = 1.5;
  shot.noise_seed = 7;
  const RenderedImage a = render(&renderer, T, shot), again = render(&renderer, T, shot);
  EXPECT_EQ(a.pixels, again.pixels);
  shot.noise_seed = 8;
  const RenderedImage b = render(&renderer, T, shot);
  double mean = 0, difference2 = 0, product = 0;
  const double n = static_cast<double>(a.pixels.size());
  for (const std::uint8_t v : a.pixels) mean += v / n;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    difference2 += std::pow(a.pixels[i] - b.pixels[i], 2) / n;
    product += (a.pixels[i] - mean) * (b.pixels[i] - mean) / n;
  }
  // The last term is the variance of rounding.
  const double variance = shot.shot_noise * mean + shot.read_noise * shot.read_noise + 1.0 / 12;
  // Standard errors over n pixels: of a variance √(2/n), of a product √(1/n) of the variance; four
  // of them.
  EXPECT_NEAR(0.5 * difference2, variance, 4 * std::sqrt(2 / n) * variance + 0.01 * variance);
  EXPECT_NEAR(product, 0, 4 * std::sqrt(1 / n) * variance);
  EXPECT_NEAR(mean, 0.8 * 255, 0.1);
}

TEST(Renderer, everySimdTargetDrawsTheSameImage) {
  Plates scene;
  scene.plate(-1.2, 1.7, -1.1, 1.4, 6.0, 1);
  const auto town = std::make_shared<const World>(WorldOptions{.seed = 5, .texture_detail = 0});
  const Transform T_town = looking_north({-1.9, 60, town->ground(-1.9, 60) + 1.7});
  RenderRequest noisy{.noise_seed = 3};
  Renderer renderer(town, Camera(lens(true)));
  RenderedImage first;
  test::on_every_target([&](const char* target) {
    const RenderedImage p = render(&renderer, T_town, noisy);
    if (first.pixels.empty()) first = p;
    // Fused or not, a product rounds differently in the last bit: a grey value may round to its
    // neighbour, and where two surfaces are equally deep the order may change, whose pixels are
    // shared by both to within the rounding.
    int differing = 0;
    for (std::size_t i = 0; i < p.pixels.size(); ++i) {
      const int d = std::abs(p.pixels[i] - first.pixels[i]);
      EXPECT_LE(d, 2) << target << " pixel " << i;
      differing += d > 0;
    }
    EXPECT_LT(differing, static_cast<int>(p.pixels.size() / 200)) << target;
  });
}

TEST(Renderer, oddSizesStayInsideTheirRows) {
  Plates scene;
  Intrinsics k = lens(true);
  k.width = 53;
  k.height = 37;
  k.cx = 26;
  k.cy = 18;
  Renderer renderer(scene.world(), Camera(k));
  constexpr int kStride = 61;
  std::vector<std::uint8_t> memory(kStride * 38, 7);
  renderer.render(looking_north({0, 0, 0}), clean(), memory.data(), kStride);
  for (int y = 0; y < 38; ++y)
    for (int x = 0; x < kStride; ++x) {
      if (y < 37 && x < 53)
        EXPECT_GT(memory[static_cast<std::size_t>(y * kStride + x)], 20);
      else
        EXPECT_EQ(memory[static_cast<std::size_t>(y * kStride + x)], 7);
    }
}

}  // namespace
}  // namespace vergence::mock
