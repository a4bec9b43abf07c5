#include "drivers/mock/world/detail/materials.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/random.hpp"

namespace vergence::mock {
namespace {

constexpr Tint kWarm{1.0F, 1.08F, 0.98F, 0.88F}, kGreen{1.0F, 0.86F, 1.08F, 0.70F},
    kBlue{1.0F, 0.90F, 1.0F, 1.15F}, kNeutral{};

Canvas paint_asphalt(std::uint64_t seed, int detail) {
  Canvas c(9 + detail, 9 + detail, 16, 16, 0.30F);
  c.octaves(5.3, 4, 0.035F, 0.8F, seed);
  // The octaves are the aggregate.
  c.octaves(0.4, 4, 0.045F, 1.1F, seed + 50);
  Random random(seed, 1);
  // Draws stones and worn spots.
  for (int i = 0; i < 2600; ++i)
    c.disc(random.uniform(0, 16), random.uniform(0, 16), random.uniform(0.02, 0.06),
           static_cast<float>(random.uniform(0.10, 0.62)), 0.65F);
  // Draws repaired trenches and patches with tarred rims.
  for (int i = 0; i < 7; ++i) {
    const double u = random.uniform(0, 16), v = random.uniform(0, 16), a = random.uniform(0.6, 3.0),
                 b = random.uniform(0.5, 1.6);
    const auto tone = static_cast<float>(random.uniform(0.17, 0.40));
    c.rectangle(u, v, u + a, v + b, tone, 0.6F);
    c.stroke(u, v, u + a, v, 0.05, 0.1F, 0.8F);
    c.stroke(u + a, v, u + a, v + b, 0.05, 0.1F, 0.8F);
    c.stroke(u, v + b, u + a, v + b, 0.05, 0.1F, 0.8F);
    c.stroke(u, v, u, v + b, 0.05, 0.1F, 0.8F);
  }
  // Draws cracks that wander.
  for (int i = 0; i < 14; ++i) {
    double u = random.uniform(0, 16), v = random.uniform(0, 16),
           heading = random.uniform(0, 2 * std::numbers::pi);
    const int length = 8 + static_cast<int>(random.below(20));
    for (int k = 0; k < length; ++k) {
      heading += random.uniform(-0.7, 0.7);
      const double nu = u + 0.25 * std::cos(heading), nv = v + 0.25 * std::sin(heading);
      c.stroke(u, v, nu, nv, 0.03, 0.08F, 0.75F);
      u = nu;
      v = nv;
    }
  }
  for (int i = 0; i < 60; ++i)
    c.disc(random.uniform(0, 16), random.uniform(0, 16), random.uniform(0.04, 0.25),
           // The discs are oil, gum and stones.
           static_cast<float>(random.uniform(0.12, 0.45)), 0.6F);
  // The disc is a manhole.
  c.disc(5.0, 11.5, 0.38, 0.14F);
  c.disc(5.0, 11.5, 0.30, 0.34F);
  for (int i = 0; i < 4; ++i) c.stroke(4.8, 11.35 + 0.1 * i, 5.2, 11.35 + 0.1 * i, 0.03, 0.1F);
  c.clamp(0.04F, 0.9F);
  return c;
}

Canvas paint_pavement(std::uint64_t seed, int detail) {
  Canvas c(8 + detail, 8 + detail, 8, 8, 0.56F);
  Random random(seed, 2);
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i)
      c.rectangle(i, j, i + 1, j + 1, 0.56F + static_cast<float>(random.uniform(-0.09, 0.09)));
  c.octaves(2.0, 6, 0.04F, 0.85F, seed);
  for (int i = 0; i < 8; ++i) {
    c.rectangle(i, 0, i + 0.035, 8, 0.2F, 0.85F);
    c.rectangle(0, i, 8, i + 0.035, 0.2F, 0.85F);
  }
  for (int i = 0; i < 40; ++i)
    c.disc(random.uniform(0, 8), random.uniform(0, 8), random.uniform(0.02, 0.09),
           static_cast<float>(random.uniform(0.25, 0.75)), 0.7F);
  c.clamp(0.05F, 0.95F);
  return c;
}

Canvas paint_grass(std::uint64_t seed, int detail) {
  Canvas c(8 + detail, 8 + detail, 8, 8, 0.36F);
  c.octaves(4.0, 7, 0.06F, 0.92F, seed);
  Random random(seed, 3);
  for (int i = 0; i < 260; ++i)
    c.disc(random.uniform(0, 8), random.uniform(0, 8), random.uniform(0.03, 0.13),
           static_cast<float>(random.uniform(0.15, 0.62)), 0.5F);
  c.clamp(0.05F, 0.9F);
  return c;
}

Canvas paint_plain(int log2, double size, float value, float amplitude, std::uint64_t seed) {
  Canvas c(log2, log2, size, size, value);
  c.octaves(size / 2, 5, amplitude, 0.85F, seed);
  c.clamp(0.03F, 0.97F);
  return c;
}

Canvas paint_roof(std::uint64_t seed, int detail) {
  Canvas c(8 + detail, 8 + detail, 8, 8, 0.40F);
  Random random(seed, 4);
  // Draws courses of tiles.
  for (int j = 0; j < 24; ++j) {
    for (int i = 0; i < 26; ++i) {
      const double w = 8.0 / 26, u = (i + 0.5 * (j % 2)) * w, v = j / 3.0;
      c.rectangle(u, v, u + w, v + 1.0 / 3,
                  0.40F + static_cast<float>(random.uniform(-0.08, 0.08)));
      c.rectangle(u, v, u + 0.035, v + 1.0 / 3, 0.2F, 0.6F);
    }
    c.rectangle(0, j / 3.0, 8, j / 3.0 + 0.06, 0.15F, 0.8F);
  }
  c.octaves(4.0, 4, 0.04F, 0.8F, seed);
  c.clamp(0.05F, 0.9F);
  return c;
}

/// Leaves in clumps, lit from above, with sky between the clumps. (u, v) in 0..1 of the crown.
void paint_foliage(std::uint64_t seed, int detail, Canvas* brightness, Canvas* opacity) {
  *brightness = Canvas(7 + detail, 7 + detail, 1, 1, 0.20F);
  *opacity = Canvas(7 + detail, 7 + detail, 1, 1, 0.0F);
  Random random(seed, 12);
  for (int clump = 0; clump < 34; ++clump) {
    const double r = 0.33 * std::sqrt(random.uniform()),
                 a = random.uniform(0, 2 * std::numbers::pi);
    const double cu = 0.5 + r * std::cos(a), cv = 0.48 + r * std::sin(a),
                 spread = random.uniform(0.035, 0.07);
    const double lit = 0.14 + 0.16 * cv + random.uniform(-0.04, 0.08);
    for (int leaf = 0; leaf < 75; ++leaf) {
      const double du = spread * random.normal(), dv = 0.75 * spread * random.normal();
      const double u = std::clamp(cu + du, 0.03, 0.97), v = std::clamp(cv + dv, 0.03, 0.97),
                   size = random.uniform(0.006, 0.017);
      brightness->disc(u, v, size * 1.6,
                       static_cast<float>(lit + 1.3 * dv + random.uniform(-0.06, 0.10)), 0.85F);
      opacity->disc(u, v, size, 1.0F);
    }
  }
  brightness->clamp(0.04F, 0.9F);
}

Canvas paint_car_side(std::uint64_t seed, int detail) {
  Canvas c(7 + detail, 6 + detail, 4.2, 1.5, 0.62F);
  c.octaves(2.0, 3, 0.03F, 0.8F, seed);
  // The rectangle is the sill and its shadow.
  c.rectangle(0, 0, 4.2, 0.22, 0.12F);
  // The rectangle is the glass.
  c.rectangle(0.75, 0.9, 3.45, 1.38, 0.14F);
  for (const double u : {1.55, 2.45}) c.rectangle(u, 0.86, u + 0.1, 1.45, 0.55F);
  c.stroke(0.85, 0.95, 1.4, 1.3, 0.08, 0.4F, 0.6F);
  for (const double u : {1.05, 2.0, 3.1}) c.rectangle(u, 0.25, u + 0.025, 0.9, 0.25F);
  c.rectangle(0, 0.84, 4.2, 0.88, 0.35F);
  c.rectangle(1.7, 0.74, 1.9, 0.78, 0.9F);
  c.rectangle(2.6, 0.74, 2.8, 0.78, 0.9F);
  for (const double u : {0.8, 3.4}) {
    c.disc(u, 0.3, 0.36, 0.05F);
    c.disc(u, 0.3, 0.22, 0.65F);
    c.disc(u, 0.3, 0.09, 0.2F);
  }
  c.rectangle(0.02, 0.6, 0.2, 0.75, 0.92F);
  c.rectangle(4.0, 0.6, 4.18, 0.75, 0.3F);
  return c;
}

Canvas paint_car_end(std::uint64_t seed, int detail) {
  Canvas c(6 + detail, 6 + detail, 1.8, 1.5, 0.6F);
  c.octaves(1.0, 3, 0.03F, 0.8F, seed);
  c.rectangle(0, 0, 1.8, 0.2, 0.1F);
  c.rectangle(0.05, 0.3, 1.75, 0.45, 0.3F);
  c.rectangle(0.2, 0.92, 1.6, 1.4, 0.13F);
  c.rectangle(0.08, 0.6, 0.42, 0.8, 0.9F);
  c.rectangle(1.38, 0.6, 1.72, 0.8, 0.9F);
  // The rectangle is the number plate.
  c.rectangle(0.65, 0.48, 1.15, 0.62, 0.95F);
  for (int i = 0; i < 6; ++i) c.rectangle(0.69 + 0.075 * i, 0.5, 0.73 + 0.075 * i, 0.6, 0.1F);
  return c;
}

Canvas paint_fence(std::uint64_t seed, int detail) {
  Canvas c(8 + detail, 6 + detail, 4, 1.2, 0.55F);
  Random random(seed, 13);
  for (int i = 0; i < 32; ++i) {
    c.rectangle(i * 0.125, 0, i * 0.125 + 0.105, 1.2,
                0.5F + static_cast<float>(random.uniform(-0.14, 0.14)));
    c.rectangle(i * 0.125 + 0.105, 0, i * 0.125 + 0.125, 1.2, 0.1F);
  }
  c.octaves(1.0, 4, 0.03F, 0.9F, seed);
  c.clamp(0.04F, 0.95F);
  return c;
}

/// Far trees: a ragged top, clumps of light. Opaque below the top.
void paint_tree_line(std::uint64_t seed, int detail, Canvas* brightness, Canvas* opacity) {
  *brightness = Canvas(8 + detail, 6 + detail, 64, 16, 0.26F);
  brightness->octaves(5.0, 5, 0.05F, 0.85F, seed);
  *opacity = Canvas(8 + detail, 6 + detail, 64, 16, 0.0F);
  Random random(seed, 14);
  opacity->rectangle(0, 0.0, 64, 6.0, 1.0F);
  for (int i = 0; i < 26; ++i) {
    const double u = random.uniform(0, 64), top = random.uniform(7.5, 14.0),
                 r = random.uniform(1.6, 3.6);
    const auto tone = static_cast<float>(random.uniform(0.17, 0.38));
    for (int k = 0; k < 40; ++k) {
      const double a = u + random.uniform(-r, r), b = random.uniform(2.0, top - 1.2);
      const double s = random.uniform(0.35, 1.1);
      brightness->disc(a, b, s, tone + static_cast<float>(random.uniform(-0.08, 0.1)), 0.7F);
      opacity->disc(a, b, s, 1.0F);
    }
  }
  brightness->clamp(0.04F, 0.8F);
}

void paint_hills(std::uint64_t seed, Canvas* brightness, Canvas* opacity) {
  *brightness = Canvas(10, 6, 2048, 128, 0.34F);
  brightness->octaves(64.0, 4, 0.05F, 0.8F, seed);
  *opacity = Canvas(10, 6, 2048, 128, 0.0F);
  Random random(seed, 15);
  std::array<double, 6> phase{};
  for (double& p : phase) p = random.uniform(0, 2 * std::numbers::pi);
  for (int x = 0; x < opacity->width(); ++x) {
    double top = 42;
    for (int k = 0; k < 6; ++k)
      top += 26.0 / (1 << (k / 2 + (k > 0))) *
             std::sin(2 * std::numbers::pi * (k * 2 + 1) * x / opacity->width() +
                      phase[static_cast<std::size_t>(k)]);
    opacity->rectangle(x * 2.0, 0, x * 2.0 + 2.0, std::clamp(top, 6.0, 118.0), 1.0F);
  }
}

Canvas paint_clouds(std::uint64_t seed) {
  Canvas c(9, 9, 4096, 4096, 0.80F);
  c.octaves(1400, 6, 0.055F, 0.62F, seed);
  c.clamp(0.66F, 0.97F);
  return c;
}

/// Four boards: a give-way triangle, a round limit, a street name, a chequered board.
Canvas paint_sign(int detail) {
  Canvas c(7 + detail, 7 + detail, 2, 2, 0.85F);
  c.stroke(0.15, 0.85, 0.85, 0.85, 0.1, 0.15F);
  c.stroke(0.15, 0.85, 0.5, 0.2, 0.1, 0.15F);
  c.stroke(0.85, 0.85, 0.5, 0.2, 0.1, 0.15F);
  c.disc(1.5, 0.5, 0.45, 0.2F);
  c.disc(1.5, 0.5, 0.34, 0.92F);
  c.rectangle(1.3, 0.32, 1.38, 0.68, 0.05F);
  c.disc(1.62, 0.5, 0.16, 0.05F);
  c.disc(1.62, 0.5, 0.08, 0.92F);
  for (int i = 0; i < 7; ++i) c.rectangle(0.1 + 0.12 * i, 1.35, 0.16 + 0.12 * i, 1.65, 0.1F);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if ((i + j) % 2 == 0)
        c.rectangle(1 + i * 0.25, 1 + j * 0.25, 1.25 + i * 0.25, 1.25 + j * 0.25, 0.08F);
  return c;
}

void paint_shadow(Canvas* brightness, Canvas* opacity) {
  *brightness = Canvas(5, 5, 1, 1, 0.10F);
  *opacity = Canvas(5, 5, 1, 1, 0.0F);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      const double u = std::abs((x + 0.5) / 16 - 1), v = std::abs((y + 0.5) / 16 - 1);
      opacity->at(x, y) = static_cast<float>(0.8 * std::clamp((1 - u) / 0.3, 0.0, 1.0) *
                                             std::clamp((1 - v) / 0.3, 0.0, 1.0));
    }
}

class Painter {
 public:
  explicit Painter(Scene* scene) : scene_(scene) {}
  void add(const Canvas& c, Tint tint) {
    scene_->materials.push_back({scene_->atlas.add(c),
                                 {},
                                 static_cast<float>(c.width() / c.width_m()),
                                 static_cast<float>(c.height() / c.height_m()),
                                 tint});
  }
  void add(const Canvas& c, const Canvas& opacity, Tint tint) {
    add(c, tint);
    scene_->materials.back().opacity = scene_->atlas.add(opacity);
  }

 private:
  Scene* scene_;
};

}  // namespace

void paint_materials(std::uint64_t seed, int detail, Scene* scene) {
  Painter p(scene);
  const std::uint64_t s = seed * 1000003U;
  for (int i = 0; i < kFacades; ++i)
    p.add(paint_facade(i, s + static_cast<std::uint64_t>(i) * 101U, detail),
          i % 3 == 1 ? kNeutral : kWarm);
  p.add(paint_side_wall(s + 900, detail), kWarm);
  p.add(paint_flats(s + 901, detail), kNeutral);
  p.add(paint_roof(s + 902, detail), Tint{1.0F, 1.2F, 0.9F, 0.75F});
  p.add(paint_asphalt(s + 903, detail), kNeutral);
  p.add(paint_pavement(s + 904, detail), kWarm);
  p.add(paint_grass(s + 905, detail), kGreen);
  p.add(paint_plain(6 + detail, 2, 0.72F, 0.05F, s + 906), kNeutral);
  p.add(paint_plain(6 + detail, 4, 0.55F, 0.05F, s + 907), kNeutral);
  Canvas a(1, 1, 1, 1, 0), b(1, 1, 1, 1, 0);
  paint_foliage(s + 908, detail, &a, &b);
  p.add(a, b, kGreen);
  p.add(paint_plain(6, 1, 0.25F, 0.06F, s + 909), kWarm);
  p.add(paint_car_side(s + 910, detail), kNeutral);
  p.add(paint_car_end(s + 911, detail), kNeutral);
  p.add(paint_plain(6, 4, 0.56F, 0.02F, s + 912), kNeutral);
  Canvas hedge = paint_plain(7 + detail, 4, 0.27F, 0.08F, s + 913);
  p.add(hedge, kGreen);
  p.add(paint_fence(s + 914, detail), kWarm);
  paint_tree_line(s + 915, detail, &a, &b);
  p.add(a, b, kGreen);
  paint_hills(s + 916, &a, &b);
  p.add(a, b, kBlue);
  p.add(paint_clouds(s + 917), kBlue);
  p.add(paint_sign(detail), kNeutral);
  paint_shadow(&a, &b);
  p.add(a, b, kNeutral);
}

}  // namespace vergence::mock
