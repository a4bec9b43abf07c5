#include <algorithm>

#include "core/math/random.hpp"
#include "drivers/mock/world/detail/materials.hpp"

namespace vergence::mock {
namespace {

/// Stretcher bond with mortar joints and single bricks burnt darker.
void bricks(Canvas& c, float mortar, float contrast, std::uint64_t seed) {
  // Sizes in m: 48 x 140 bricks tile 12 m x 12 m.
  constexpr double kBrick = 0.25, kCourse = 0.0857;
  Random random(seed, 5);
  const int across = static_cast<int>(c.width_m() / kBrick + 0.5),
            up = static_cast<int>(c.height_m() / kCourse + 0.5);
  const double h = c.height_m() / up;
  for (int j = 0; j < up; ++j) {
    for (int i = 0; i < across; ++i) {
      const double u = (i + (j % 2) * 0.5) * kBrick, v = j * h;
      const auto shade = static_cast<float>(random.uniform(-1, 1)) * contrast;
      const float own = c.at(
          std::clamp(static_cast<int>((u + 0.12) / c.width_m() * c.width()), 0, c.width() - 1),
          std::clamp(static_cast<int>((v + 0.04) / c.height_m() * c.height()), 0, c.height() - 1));
      c.rectangle(u + 0.01, v + 0.01, u + kBrick, v + h, own + shade, 0.9F);
      c.rectangle(u, v, u + 0.012, v + h, mortar, 0.6F);
    }
    c.rectangle(0, j * h, c.width_m(), j * h + 0.012, mortar, 0.6F);
  }
}

/// Horizontal boards with a shadow line under each.
void boards(Canvas& c, double pitch, float shadow, std::uint64_t seed) {
  Random random(seed, 6);
  const int n = static_cast<int>(c.height_m() / pitch + 0.5);
  for (int j = 0; j < n; ++j) {
    const double v = j * c.height_m() / n;
    c.rectangle(0, v, c.width_m(), v + 0.03, shadow, 0.55F);
    for (double u = random.uniform(0, 3); u < c.width_m(); u += random.uniform(2.0, 4.5))
      c.rectangle(u, v, u + 0.015, v + pitch, shadow, 0.5F);
  }
}

struct Window {
  double u, v, width, height;
  int panes_across, panes_up;
};

/// Frame, sill, lintel, panes with what is behind them.
void window(Canvas& c, const Window& w, float frame, Random& random) {
  c.rectangle(w.u - 0.1, w.v - 0.1, w.u + w.width + 0.1, w.v + w.height + 0.1, frame);
  c.rectangle(w.u - 0.18, w.v - 0.18, w.u + w.width + 0.18, w.v - 0.1, frame * 0.85F);
  // The lintel is in its own shadow.
  c.rectangle(w.u - 0.12, w.v + w.height + 0.1, w.u + w.width + 0.12, w.v + w.height + 0.25, 0.25F,
              0.7F);
  const double pu = w.width / w.panes_across, pv = w.height / w.panes_up;
  const int curtain = static_cast<int>(random.below(4));
  for (int j = 0; j < w.panes_up; ++j)
    for (int i = 0; i < w.panes_across; ++i) {
      const double u = w.u + i * pu + 0.03, v = w.v + j * pv + 0.03;
      const auto glass = static_cast<float>(random.uniform(0.05, 0.22));
      c.rectangle(u, v, u + pu - 0.06, v + pv - 0.06, glass);
      const bool edge = i == 0 || i == w.panes_across - 1;
      if (curtain == 1 && edge) c.rectangle(u, v, u + pu * 0.45, v + pv - 0.06, 0.55F, 0.8F);
      if (curtain == 2 && j == w.panes_up - 1)
        // The rectangle is a blind.
        c.rectangle(u, v + pv * 0.4, u + pu - 0.06, v + pv - 0.06, 0.62F, 0.85F);
      if (curtain == 3)
        // The stroke is a reflection.
        c.stroke(u, v, u + pu * 0.7, v + pv * 0.8, 0.12, 0.45F, 0.5F);
    }
}

void door(Canvas& c, double u, double width, float paint, float frame) {
  c.rectangle(u - 0.12, 0.1, u + width + 0.12, 2.35, frame);
  c.rectangle(u, 0.1, u + width, 2.2, paint);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 3; ++j)
      c.rectangle(u + 0.12 + i * width * 0.48, 0.3 + j * 0.62, u + width * 0.45 + i * width * 0.46,
                  0.78 + j * 0.62, j == 2 ? 0.12F : paint * 0.75F);
  c.disc(u + width - 0.1, 1.15, 0.045, 0.9F);
  // The rectangle is a step.
  c.rectangle(u - 0.3, 0, u + width + 0.3, 0.12, 0.7F);
}

void downpipe(Canvas& c, double u, float value) {
  c.rectangle(u, 0, u + 0.1, c.height_m(), value);
  c.rectangle(u + 0.1, 0, u + 0.14, c.height_m(), 0.15F, 0.5F);
}

/// Rain and dirt: darker towards the ground and in streaks.
void weather(Canvas& c, std::uint64_t seed) {
  c.octaves(4.0, 5, 0.035F, 0.75F, seed);
  c.noise(0.35, 3.0, 0.025F, seed + 7);
  for (int i = 0; i < 6; ++i) c.rectangle(0, 0, c.width_m(), 0.1 + 0.08 * i, 0.25F, 0.06F);
  c.clamp(0.03F, 0.97F);
}

void shopfront(Canvas& c, Random& random) {
  // The rectangle is a fascia with lettering.
  c.rectangle(0, 2.75, 12, 3.35, 0.82F);
  for (double u = 0.7; u < 10.8; u += random.uniform(0.32, 0.62)) {
    const double h = random.uniform(0.22, 0.36);
    c.rectangle(u, 2.9, u + 0.07, 2.9 + h, 0.08F);
    c.rectangle(u, 2.9 + h * random.uniform(0.3, 0.9), u + 0.22, 2.96 + h * 0.9, 0.08F);
  }
  for (int i = 0; i < 4; ++i) {
    const double u = 0.5 + i * 2.9;
    c.rectangle(u - 0.1, 0.35, u + 2.4, 2.6, 0.7F);
    c.rectangle(u, 0.45, u + 2.3, 2.5, static_cast<float>(random.uniform(0.08, 0.2)));
    for (int k = 0; k < 5; ++k) {
      const double a = u + random.uniform(0.1, 1.7), b = random.uniform(0.5, 1.8);
      c.rectangle(a, b, a + random.uniform(0.15, 0.5), b + random.uniform(0.15, 0.6),
                  static_cast<float>(random.uniform(0.2, 0.9)));
    }
  }
}

struct FacadeStyle {
  float wall, frame, door;
  /// 0 for render, 1 for bricks, 2 for boards.
  int cladding;
  double window_width, window_height;
  /// Number of windows per storey.
  int windows;
  int panes_across, panes_up;
};

constexpr FacadeStyle kStyles[kFacades] = {
    // Red brick with white sashes.
    {0.42F, 0.85F, 0.30F, 1, 1.3, 1.4, 3, 2, 2},
    // Painted weatherboard.
    {0.74F, 0.92F, 0.22F, 2, 1.6, 1.3, 3, 3, 1},
    // Rendered, with dark aluminium.
    {0.66F, 0.35F, 0.45F, 0, 2.2, 1.5, 2, 3, 1},
    // Shop below and flat above.
    {0.52F, 0.80F, 0.15F, 0, 1.1, 1.6, 4, 1, 2},
    // Dark brick.
    {0.28F, 0.70F, 0.60F, 1, 1.0, 1.2, 4, 1, 2},
    // Old timber house with a verandah.
    {0.58F, 0.75F, 0.18F, 2, 1.2, 1.5, 4, 2, 3},
    // White render.
    {0.80F, 0.55F, 0.35F, 0, 1.8, 1.2, 3, 2, 1},
};

}  // namespace

Canvas paint_facade(int kind, std::uint64_t seed, int detail) {
  const FacadeStyle& s = kStyles[kind];
  Canvas c(8 + detail, 8 + detail, kFacadeWidth, kFacadeHeight, s.wall);
  c.octaves(6.0, 3, 0.03F, 0.7F, seed);
  if (s.cladding == 1) bricks(c, s.wall + 0.16F, 0.07F, seed + 1);
  if (s.cladding == 2) boards(c, 0.2, s.wall * 0.55F, seed + 2);
  Random random(seed, 9);
  for (int storey = 0; storey < 4; ++storey) {
    const double floor = storey * kStorey;
    if (storey > 0)
      c.rectangle(0, floor - 0.12, 12, floor + 0.1, storey % 2 == 1 ? s.frame : s.wall * 0.8F,
                  0.85F);
    const int door_slot =
        storey == 0 ? static_cast<int>(random.below(static_cast<std::uint32_t>(s.windows))) : -1;
    if (kind == 3 && storey == 0) {
      shopfront(c, random);
      continue;
    }
    const double pitch = 12.0 / s.windows;
    for (int i = 0; i < s.windows; ++i) {
      const double centre = (i + 0.5) * pitch + random.uniform(-0.2, 0.2);
      if (i == door_slot) {
        door(c, centre - 0.5, 1.0, s.door, s.frame);
        continue;
      }
      window(c,
             {centre - 0.5 * s.window_width, floor + 0.95, s.window_width, s.window_height,
              s.panes_across, s.panes_up},
             s.frame, random);
    }
    // The house has a verandah with rail and posts.
    if (kind == 5) {
      c.rectangle(0, floor + 0.85, 12, floor + 0.95, s.frame);
      for (double u = 0.1; u < 12; u += 0.3)
        c.rectangle(u, floor + 0.1, u + 0.06, floor + 0.9, s.frame, 0.9F);
      for (double u = 0.2; u < 12; u += 2.9) c.rectangle(u, floor, u + 0.16, floor + 2.9, s.frame);
    }
  }
  downpipe(c, random.uniform(0.2, 0.6), s.frame * 0.8F);
  downpipe(c, random.uniform(11.2, 11.6), s.frame * 0.8F);
  weather(c, seed + 3);
  return c;
}

Canvas paint_side_wall(std::uint64_t seed, int detail) {
  Canvas c(8 + detail, 8 + detail, kFacadeWidth, kFacadeHeight, 0.5F);
  c.octaves(6.0, 3, 0.04F, 0.7F, seed);
  bricks(c, 0.62F, 0.05F, seed + 1);
  Random random(seed, 10);
  for (int storey = 0; storey < 4; ++storey)
    for (int i = 0; i < 3; ++i)
      if (random.below(3) != 0)
        window(
            c,
            {1.2 + i * 3.8 + random.uniform(-0.5, 0.5), storey * kStorey + random.uniform(1.1, 1.5),
             random.uniform(0.6, 1.1), random.uniform(0.6, 1.1), 1, 1},
            0.75F, random);
  weather(c, seed + 3);
  return c;
}

Canvas paint_flats(std::uint64_t seed, int detail) {
  Canvas c(8 + std::max(0, detail - 1), 8 + std::max(0, detail - 1), 24, 24, 0.6F);
  Random random(seed, 11);
  for (int j = 0; j < 8; ++j) {
    c.rectangle(0, j * 3.0, 24, j * 3.0 + 0.35, 0.78F);
    for (int i = 0; i < 8; ++i) {
      const double u = i * 3.0 + 0.4;
      c.rectangle(u, j * 3.0 + 0.9, u + random.uniform(1.4, 2.3), j * 3.0 + 2.5,
                  static_cast<float>(random.uniform(0.08, 0.3)));
      if (random.below(3) == 0)
        // The rectangle is a balcony.
        c.rectangle(u, j * 3.0 + 0.3, u + 2.2, j * 3.0 + 1.2, 0.85F);
    }
  }
  weather(c, seed + 3);
  return c;
}

}  // namespace vergence::mock
