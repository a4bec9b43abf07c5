#include "drivers/mock/world/detail/town.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace vergence::mock {
namespace {

/// x of the streets that run along y.
constexpr std::array<double, 3> kStreetX{0, kStreetSpacingX, 2 * kStreetSpacingX};
/// y of the streets that run along x.
constexpr std::array<double, 3> kStreetY{0, kStreetSpacingY, 2 * kStreetSpacingY};
/// Length in m.
constexpr double kLot = 12.0;
/// Length in m of a block's corner that belongs to the houses of the other street.
constexpr double kFrontDepth = 24.0;
/// Radius in m of the hills on the horizon.
constexpr double kRing = 1200.0;
/// Height in m: enough to lie above the road, too little to show in a disparity.
constexpr double kPaintThickness = 0.001;
/// Height in m.
constexpr double kCloudHeight = 900.0;

/// Ground between four centrelines; on the outer sides of the town there is no street.
struct Block {
  double x0, x1, y0, y1;
  /// True if a street runs along that side.
  bool west, east, south, north;
};

std::vector<Block> blocks() {
  const std::array<double, 5> xs{kWorldX0 + 30, kStreetX[0], kStreetX[1], kStreetX[2],
                                 kWorldX1 - 30};
  const std::array<double, 5> ys{kWorldY0 + 30, kStreetY[0], kStreetY[1], kStreetY[2],
                                 kWorldY1 - 30};
  std::vector<Block> out;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i)
      out.push_back({xs[i], xs[i + 1], ys[j], ys[j + 1], i > 0, i<3, j> 0, j < 3});
  return out;
}

/// Two points a corner, counter-clockwise from the south-west; the same point twice where a corner
/// is not cut. `inset` moves the sides along streets inwards.
std::array<Vec2, 8> outline(const Block& b, double inset) {
  const double edge = kRoadHalf + inset, cut = kCornerCut - inset * (2 - std::numbers::sqrt2);
  const double x0 = b.x0 + (b.west ? edge : 0), x1 = b.x1 - (b.east ? edge : 0),
               y0 = b.y0 + (b.south ? edge : 0), y1 = b.y1 - (b.north ? edge : 0);
  const double sw = b.south && b.west ? cut : 0, se = b.south && b.east ? cut : 0,
               ne = b.north && b.east ? cut : 0, nw = b.north && b.west ? cut : 0;
  return {Vec2(x0, y0 + sw), Vec2(x0 + sw, y0), Vec2(x1 - se, y0), Vec2(x1, y0 + se),
          Vec2(x1, y1 - ne), Vec2(x1 - ne, y1), Vec2(x0 + nw, y1), Vec2(x0, y1 - nw)};
}

void add_block_ground(SceneBuilder* builder, const Block& b) {
  const auto kerb_line = outline(b, 0), stone = outline(b, 0.28), back = outline(b, kPavementWidth);
  for (std::size_t i = 0; i < 8; ++i) {
    const std::size_t j = (i + 1) % 8;
    // There is no street on this side.
    if ((kerb_line[i] - stone[i]).norm() < 1e-9 && (kerb_line[j] - stone[j]).norm() < 1e-9)
      continue;
    if ((kerb_line[j] - kerb_line[i]).norm() < 1e-9) continue;
    // A side towards open country keeps its line: only sides that moved are kerbs.
    const Vec2 d = (kerb_line[j] - kerb_line[i]).normalized(), normal(-d.y(), d.x());
    if (std::abs(normal.dot(stone[i] - kerb_line[i])) < 1e-9) continue;
    builder->kerb(kerb_line[i], kerb_line[j]);
    builder->ground_polygon(std::array<Vec2, 4>{kerb_line[i], kerb_line[j], stone[j], stone[i]},
                            kKerb, material::concrete, 1.15F);
    builder->ground_polygon(std::array<Vec2, 4>{stone[i], stone[j], back[j], back[i]}, kKerb,
                            material::pavement);
  }
  builder->ground_polygon(back, kKerb, material::grass);
}

void add_roads(SceneBuilder* builder) {
  for (const double y : kStreetY)
    builder->ground_polygon(
        std::array<Vec2, 4>{Vec2(kWorldX0 + 30, y - kRoadHalf), Vec2(kWorldX1 - 30, y - kRoadHalf),
                            Vec2(kWorldX1 - 30, y + kRoadHalf), Vec2(kWorldX0 + 30, y + kRoadHalf)},
        0, material::asphalt);
  for (const double x : kStreetX) {
    double from = kWorldY0 + 30;
    // Covers the stretches between the crossings.
    for (std::size_t k = 0; k <= kStreetY.size(); ++k) {
      const double to = k < kStreetY.size() ? kStreetY[k] - kRoadHalf : kWorldY1 - 30;
      builder->ground_polygon(
          std::array<Vec2, 4>{Vec2(x - kRoadHalf, from), Vec2(x + kRoadHalf, from),
                              Vec2(x + kRoadHalf, to), Vec2(x - kRoadHalf, to)},
          0, material::asphalt);
      from = to + 2 * kRoadHalf;
    }
    // Covers what the cut kerbs leave open.
    for (const double y : kStreetY)
      for (const double sx : {-1.0, 1.0})
        for (const double sy : {-1.0, 1.0}) {
          std::array<Vec2, 3> corner{Vec2(x + sx * kRoadHalf, y + sy * kRoadHalf),
                                     Vec2(x + sx * (kRoadHalf + kCornerCut), y + sy * kRoadHalf),
                                     Vec2(x + sx * kRoadHalf, y + sy * (kRoadHalf + kCornerCut))};
          if (sx * sy < 0) std::swap(corner[1], corner[2]);
          builder->ground_polygon(corner, 0, material::asphalt);
        }
  }
}

/// A painted bar centred at c, `half_a` along and `half_b` across direction d.
void mark(SceneBuilder* builder, const Vec2& c, const Vec2& d, double half_a, double half_b,
          float light) {
  const Vec2 n(-d.y(), d.x());
  const Vec2 a = half_a * d, b = half_b * n;
  builder->ground_polygon(std::array<Vec2, 4>{c - a - b, c + a - b, c + a + b, c - a + b},
                          kPaintThickness, material::paint, light);
}

void mark_street(SceneBuilder* builder, const Vec2& start, const Vec2& d, double length,
                 std::span<const double> crossings, Random* random) {
  const Vec2 n(-d.y(), d.x());
  const auto near_crossing = [&](double s, double margin) {
    return std::any_of(crossings.begin(), crossings.end(),
                       [&](double c) { return std::abs(s - c) < kRoadHalf + margin; });
  };
  for (double s = 2; s < length - 3; s += 7.5)
    if (!near_crossing(s, 5))
      mark(builder, start + s * d, d, 1.5, 0.06, static_cast<float>(random->uniform(0.8, 1.1)));
  // Draws the corners of the parking bays.
  for (double s = 1; s < length - 3; s += 6.0)
    if (!near_crossing(s, 9))
      for (const double side : {-1.0, 1.0}) {
        mark(builder, start + s * d + side * (kRoadHalf - 2.1) * n, d, 0.5, 0.05, 0.95F);
        mark(builder, start + s * d + side * (kRoadHalf - 1.75) * n, n, 0.35, 0.05, 0.95F);
      }
  for (const double c : crossings)
    for (const double side : {-1.0, 1.0}) {
      // Traffic keeps left: the stop line is on the left half as one comes to the crossing.
      const Vec2 at = start + (c + side * (kRoadHalf + kCornerCut + 1.2)) * d +
                      side * 0.5 * kRoadHalf * -n * -1.0;
      mark(builder, at, n, 0.5 * kRoadHalf - 0.3, 0.2, 1.1F);
      // Draws a zebra crossing in front.
      for (int k = 0; k < 6; ++k)
        mark(builder,
             start + (c + side * (kRoadHalf + kCornerCut + 3.4)) * d + (-4.5 + 1.8 * k) * n, d, 1.2,
             0.32, 1.05F);
    }
}

/// One side of a street between two crossings: houses, gardens, cars, trees, poles.
void add_side(SceneBuilder* builder, const WorldOptions& options, const Vec2& start, const Vec2& d,
              const Vec2& outward, double from, double to, Random* random) {
  const Vec2 along(outward.y(), -outward.x());
  const auto lots = static_cast<int>((to - from) / kLot);
  const double first = from + 0.5 * (to - from - lots * kLot) + 0.5 * kLot;
  for (int i = 0; i < lots; ++i) {
    const Lot lot{start + (first + i * kLot) * d, along, outward};
    const bool built = random->uniform() < options.built_fraction;
    if (built)
      add_house(builder, lot, random);
    else {
      const int trees = 1 + static_cast<int>(random->below(3));
      for (int k = 0; k < trees; ++k)
        add_tree(builder, lot.at(random->uniform(-5, 5), random->uniform(11, 22)),
                 random->uniform(4, 8), kKerb, random);
    }
    if (random->uniform() < 0.6 || !built) add_garden(builder, lot, random);
    if (random->uniform() < options.car_fraction)
      add_car(builder, lot, random->uniform(-3, 3), random);
    if (random->uniform() < options.tree_fraction)
      add_tree(builder, lot.at(random->uniform(-5, 5), kRoadHalf + 1.0), random->uniform(4.5, 7.0),
               kKerb, random);
    if (i % 3 == 1) add_power_pole(builder, {lot.at(0.5 * kLot, 0), along, outward});
  }
}

void add_block_houses(SceneBuilder* builder, const WorldOptions& options, const Block& b,
                      Random* random) {
  const double clear = kRoadHalf + kCornerCut + 1.0;
  const double wx0 = b.x0 + (b.west ? clear : 0), wx1 = b.x1 - (b.east ? clear : 0);
  if (b.south)
    add_side(builder, options, {0, b.y0}, Vec2::UnitX(), Vec2::UnitY(), wx0, wx1, random);
  if (b.north)
    add_side(builder, options, {0, b.y1}, Vec2::UnitX(), -Vec2::UnitY(), wx0, wx1, random);
  const double wy0 = b.y0 + (b.south ? kFrontDepth : 0), wy1 = b.y1 - (b.north ? kFrontDepth : 0);
  if (b.west) add_side(builder, options, {b.x0, 0}, Vec2::UnitY(), Vec2::UnitX(), wy0, wy1, random);
  if (b.east)
    add_side(builder, options, {b.x1, 0}, Vec2::UnitY(), -Vec2::UnitX(), wy0, wy1, random);
  for (const double x : {b.x0, b.x1})
    for (const double y : {b.y0, b.y1}) {
      const bool street = (x == b.x0 ? b.west : b.east) && (y == b.y0 ? b.south : b.north);
      if (!street) continue;
      const double sx = x == b.x0 ? 1 : -1, sy = y == b.y0 ? 1 : -1;
      add_sign(builder, {x + sx * (kRoadHalf + kCornerCut + 0.6), y + sy * (kRoadHalf + 0.5)},
               {sx, 0}, static_cast<int>(random->below(4)));
      add_sign(builder, {x + sx * (kRoadHalf + 0.5), y + sy * (kRoadHalf + kCornerCut + 0.6)},
               {0, sy}, static_cast<int>(random->below(4)));
    }
}

/// Background behind the houses: tall flats and rows of trees inside a block, 35 m and more from
/// any street.
void add_block_interior(SceneBuilder* builder, const Block& b, Random* random) {
  const double cx = 0.5 * (b.x0 + b.x1), cy = 0.5 * (b.y0 + b.y1), half = 0.5 * (b.x1 - b.x0);
  for (const double x : {cx - 0.45 * half, cx + 0.45 * half}) {
    if (random->uniform() < 0.55)
      add_flats(builder, {x + random->uniform(-8, 8), cy + random->uniform(-6, 6)},
                random->uniform(9, 14), random->uniform(5, 7),
                4 + static_cast<int>(random->below(4)), random);
    else
      for (int k = 0; k < 5; ++k)
        add_tree(builder, {x + random->uniform(-18, 18), cy + random->uniform(-12, 12)},
                 random->uniform(8, 14), kKerb, random);
  }
  const double edge = 30.0;
  for (double x = b.x0 + edge; x < b.x1 - edge - 10; x += 24)
    add_tree_line(builder, {x, cy + random->uniform(-7, 7)}, {x + 28, cy + random->uniform(-7, 7)},
                  random->uniform(6, 10), random);
}

/// Rows of trees round the town, hills far behind, clouds above, grass without end.
void add_surroundings(SceneBuilder* builder, Random* random) {
  for (const double out : {24.0, 6.0}) {
    const double x0 = kWorldX0 + out, x1 = kWorldX1 - out, y0 = kWorldY0 + out, y1 = kWorldY1 - out;
    // The inner row has gaps.
    const double step = out > 10 ? 44 : 30;
    const auto jitter = [&] { return random->uniform(-4, 4); };
    for (double x = x0; x < x1; x += step)
      for (const double y : {y0, y1})
        add_tree_line(builder, {x, y + jitter()}, {x + 34, y + jitter()}, random->uniform(10, 17),
                      random);
    for (double y = y0; y < y1; y += step)
      for (const double x : {x0, x1})
        add_tree_line(builder, {x + jitter(), y}, {x + jitter(), y + 34}, random->uniform(10, 17),
                      random);
  }
  builder->begin();
  const Vec2 middle(0.5 * (kWorldX0 + kWorldX1), 0.5 * (kWorldY0 + kWorldY1));
  constexpr int kSides = 24;
  const double side = 2 * kRing * std::tan(std::numbers::pi / kSides);
  for (int i = 0; i < kSides; ++i) {
    const auto at = [&](int k, double z) {
      const double a = 2 * std::numbers::pi * (k - 0.5) / kSides,
                   r = kRing / std::cos(std::numbers::pi / kSides);
      return Vec3(middle.x() + r * std::cos(a), middle.y() + r * std::sin(a), z);
    };
    const std::array<Vec3, 4> corners{at(i + 1, -10), at(i, -10), at(i, 130), at(i + 1, 130)};
    // The texture's top is left out, because textures wrap around.
    builder->textured_quad(corners, material::hills, 1.0F, side * kSides / 4, 150);
  }
  builder->end();
  builder->begin();
  const double r = 40 * kCloudHeight;
  const std::array<Vec3, 4> sky{Vec3(-r, r, kCloudHeight), Vec3(r, r, kCloudHeight),
                                Vec3(r, -r, kCloudHeight), Vec3(-r, -r, kCloudHeight)};
  builder->textured_quad(sky, material::clouds, 1.12F, 4096, 4096);
  builder->end();
}

void add_open_country(SceneBuilder* builder) {
  constexpr double kFar = 2500.0;
  const double x0 = kWorldX0 + 30, x1 = kWorldX1 - 30, y0 = kWorldY0 + 30, y1 = kWorldY1 - 30;
  const auto rectangle = [&](double a0, double b0, double a1, double b1) {
    builder->ground_polygon(
        std::array<Vec2, 4>{Vec2(a0, b0), Vec2(a1, b0), Vec2(a1, b1), Vec2(a0, b1)}, kKerb,
        material::grass);
  };
  rectangle(-kFar, -kFar, x0, kFar);
  rectangle(x1, -kFar, kFar, kFar);
  rectangle(x0, -kFar, x1, y0);
  rectangle(x0, y1, x1, kFar);
}

}  // namespace

void build_town(const WorldOptions& options, Scene* scene) {
  SceneBuilder builder(options, scene);
  Random random(options.seed, 20);
  add_open_country(&builder);
  add_roads(&builder);
  for (const double y : kStreetY) {
    const std::array<double, 3> crossings{120, 120 + kStreetSpacingX, 120 + 2 * kStreetSpacingX};
    mark_street(&builder, {kWorldX0 + 30, y}, Vec2::UnitX(), kWorldX1 - kWorldX0 - 60, crossings,
                &random);
  }
  for (const double x : kStreetX) {
    const std::array<double, 3> crossings{120, 120 + kStreetSpacingY, 120 + 2 * kStreetSpacingY};
    mark_street(&builder, {x, kWorldY0 + 30}, Vec2::UnitY(), kWorldY1 - kWorldY0 - 60, crossings,
                &random);
  }
  for (const Block& b : blocks()) {
    add_block_ground(&builder, b);
    add_block_houses(&builder, options, b, &random);
    add_block_interior(&builder, b, &random);
  }
  add_surroundings(&builder, &random);
}

}  // namespace vergence::mock
