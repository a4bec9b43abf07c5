#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/mock/world/detail/town.hpp"

namespace vergence::mock {
namespace {

Vec3 raised(const Vec2& p, double z) { return {p.x(), p.y(), z}; }

float paint(Random* random, double lo, double hi) {
  return static_cast<float>(random->uniform(lo, hi));
}

/// Four slopes over a rectangle, ridge along its length.
void hip_roof(SceneBuilder* builder, const SceneBuilder::Box& walls, double rise, float light) {
  // Overhang in m.
  constexpr double kOverhang = 0.45;
  const double l = walls.half_length + kOverhang, w = walls.half_width + kOverhang,
               ridge = std::max(0.3, l - w);
  const Vec2 a = walls.along, n(a.y(), -a.x());
  const double z0 = walls.base.z() + walls.height - 0.1, z1 = z0 + rise;
  const Vec2 c = walls.base.head<2>();
  const auto at = [&](double s, double t, double z) { return raised(c + s * a + t * n, z); };
  const SceneBuilder::Face face{material::roof, light, 0, 0};
  builder->flat(
      std::array<Vec3, 4>{at(-l, w, z0), at(l, w, z0), at(ridge, 0, z1), at(-ridge, 0, z1)}, face);
  builder->flat(
      std::array<Vec3, 4>{at(l, -w, z0), at(-l, -w, z0), at(-ridge, 0, z1), at(ridge, 0, z1)},
      face);
  builder->flat(std::array<Vec3, 3>{at(l, w, z0), at(l, -w, z0), at(ridge, 0, z1)}, face);
  builder->flat(std::array<Vec3, 3>{at(-l, -w, z0), at(-l, w, z0), at(-ridge, 0, z1)}, face);
  // Eaves seen from below.
  builder->flat(std::array<Vec3, 4>{at(-l, -w, z0), at(l, -w, z0), at(l, w, z0), at(-l, w, z0)},
                {material::concrete, 0.55F, 0, 0}, true);
}

}  // namespace

void add_house(SceneBuilder* builder, const Lot& lot, Random* random) {
  const double setback = kRoadHalf + kPavementWidth + random->uniform(0.4, 6.0);
  const std::uint32_t draw = random->below(20);
  const int storeys = draw < 9 ? 1 : draw < 17 ? 2 : 3;
  const int kind = static_cast<int>(random->below(kFacades));
  const double half_length = random->uniform(5.0, 6.0), half_width = random->uniform(4.0, 5.0);
  const double height = storeys * kStorey + (storeys == 1 ? 0.9 : 0.4);
  SceneBuilder::Box walls;
  walls.along = lot.along;
  walls.half_length = half_length;
  walls.half_width = half_width;
  const Vec2 centre = lot.at(random->uniform(-0.4, 0.4), setback + half_width);
  // The walls reach `below` m into the slope.
  const double floor = builder->ground(centre.x()) + kKerb, below = 0.7;
  walls.base = raised(centre, floor - below);
  walls.height = height + below;
  const float tone = paint(random, 0.78, 1.0);
  const double shift = (kFacadeWidth - 2 * half_length) * 0.5;
  builder->begin();
  const SceneBuilder::Face front{kind, tone, shift, -below},
      side{material::side_wall, tone, random->uniform(0, 12), -below};
  const SceneBuilder::Face flat_top{material::concrete, 0.8F, 0, 0};
  const bool parapet = kind == 3 || storeys == 3;
  builder->box(walls, front, side, parapet ? &flat_top : nullptr);
  if (!parapet) hip_roof(builder, walls, random->uniform(1.4, 2.3), paint(random, 0.7, 1.25));
  // The house has a porch: posts and a roof over the door.
  if (random->below(3) == 0) {
    const double depth = 1.6, reach = random->uniform(1.5, 3.0),
                 offset = random->uniform(-2.0, 2.0);
    for (const double s : {-reach, reach})
      builder->box(
          {raised(lot.at(offset + s, setback - depth), floor - 0.2), lot.along, 0.08, 0.08, 2.9},
          {material::concrete, 1.3F, 0, 0}, {material::concrete, 1.3F, 0, 0}, nullptr);
    const SceneBuilder::Face roof{material::roof, tone, 0, 0};
    builder->box({raised(lot.at(offset, setback - 0.5 * depth), floor + 2.6), lot.along,
                  reach + 0.3, 0.5 * depth + 0.2, 0.22},
                 {material::concrete, 1.2F, 0, 0}, {material::concrete, 1.2F, 0, 0}, &roof);
  }
  builder->end();
}

void add_garden(SceneBuilder* builder, const Lot& lot, Random* random) {
  const double line = kRoadHalf + kPavementWidth + 0.45;
  const int kind = random->below(2) == 0 ? material::hedge : material::fence;
  const double height = kind == material::hedge ? random->uniform(0.7, 1.3) : 1.15,
               half = kind == material::hedge ? 0.3 : 0.04;
  const float tone = paint(random, 0.75, 1.3);
  const double gate = random->uniform(-3.5, 3.5);
  builder->begin();
  for (const auto& [a, b] : {std::pair{-5.8, gate - 0.7}, std::pair{gate + 0.7, 5.8}}) {
    const Vec2 foot = lot.at(0.5 * (a + b), line);
    const SceneBuilder::Face face{kind, tone, random->uniform(0, 3), -0.25},
        top{kind, tone * 1.05F, 0, 0};
    builder->box({raised(foot, builder->ground(foot.x()) + kKerb - 0.25), lot.along, 0.5 * (b - a),
                  half, height + 0.25},
                 face, face, &top);
  }
  builder->end();
}

void add_car(SceneBuilder* builder, const Lot& lot, double along_m, Random* random) {
  constexpr double kHalfLength = 2.1, kHalfWidth = 0.88, kFloor = -0.05, kBelt = 0.88, kTop = 1.45;
  const Vec2 c = lot.at(along_m, kRoadHalf - 1.1);
  const Vec2 a = random->below(2) == 0 ? lot.along : Vec2(-lot.along), n(a.y(), -a.x());
  // The car stands on the slope: its own z axis stays vertical, its floor follows the ground.
  const double slope = (builder->ground(c.x() + 0.5) - builder->ground(c.x() - 0.5)) * a.x();
  const double ground = builder->ground(c.x());
  const auto at = [&](double s, double t, double z) {
    return raised(c + s * a + t * n, ground + slope * s + z);
  };
  const float tone = paint(random, 0.4, 1.2);
  builder->begin();
  builder->flat(
      std::array<Vec3, 4>{at(-kHalfLength, kHalfWidth, kFloor), at(kHalfLength, kHalfWidth, kFloor),
                          at(kHalfLength, kHalfWidth, kBelt), at(-kHalfLength, kHalfWidth, kBelt)},
      {material::car_side, tone, 0, 0});
  builder->flat(std::array<Vec3, 4>{at(kHalfLength, -kHalfWidth, kFloor),
                                    at(-kHalfLength, -kHalfWidth, kFloor),
                                    at(-kHalfLength, -kHalfWidth, kBelt),
                                    at(kHalfLength, -kHalfWidth, kBelt)},
                {material::car_side, tone, 0, 0});
  builder->flat(
      std::array<Vec3, 4>{at(kHalfLength, kHalfWidth, kFloor), at(kHalfLength, -kHalfWidth, kFloor),
                          at(kHalfLength, -kHalfWidth, kBelt), at(kHalfLength, kHalfWidth, kBelt)},
      {material::car_end, tone, 0, 0});
  builder->flat(
      std::array<Vec3, 4>{at(-kHalfLength, -kHalfWidth, kFloor),
                          at(-kHalfLength, kHalfWidth, kFloor), at(-kHalfLength, kHalfWidth, kBelt),
                          at(-kHalfLength, -kHalfWidth, kBelt)},
      {material::car_end, tone, 0, 0});
  builder->flat(
      std::array<Vec3, 4>{at(-kHalfLength, kHalfWidth, kBelt), at(kHalfLength, kHalfWidth, kBelt),
                          at(kHalfLength, -kHalfWidth, kBelt),
                          at(-kHalfLength, -kHalfWidth, kBelt)},
      {material::car_top, tone, 0, 0});
  // The cabin leans inwards on all sides.
  constexpr double r0 = -1.5, f0 = 1.35, r1 = -1.0, f1 = 0.55, w1 = 0.66;
  builder->flat(std::array<Vec3, 4>{at(r0, kHalfWidth, kBelt), at(f0, kHalfWidth, kBelt),
                                    at(f1, w1, kTop), at(r1, w1, kTop)},
                {material::car_side, tone, r0 + kHalfLength, kBelt});
  builder->flat(std::array<Vec3, 4>{at(f0, -kHalfWidth, kBelt), at(r0, -kHalfWidth, kBelt),
                                    at(r1, -w1, kTop), at(f1, -w1, kTop)},
                {material::car_side, tone, kHalfLength - f0, kBelt});
  builder->flat(std::array<Vec3, 4>{at(f0, kHalfWidth, kBelt), at(f0, -kHalfWidth, kBelt),
                                    at(f1, -w1, kTop), at(f1, w1, kTop)},
                {material::car_end, tone, 0, kBelt});
  builder->flat(std::array<Vec3, 4>{at(r0, -kHalfWidth, kBelt), at(r0, kHalfWidth, kBelt),
                                    at(r1, w1, kTop), at(r1, -w1, kTop)},
                {material::car_end, tone, 0, kBelt});
  builder->flat(
      std::array<Vec3, 4>{at(r1, w1, kTop), at(f1, w1, kTop), at(f1, -w1, kTop), at(r1, -w1, kTop)},
      {material::car_top, tone, 0, 0});
  builder->textured_quad(std::array<Vec3, 4>{at(-kHalfLength - 0.35, kHalfWidth + 0.35, 0.004),
                                             at(kHalfLength + 0.35, kHalfWidth + 0.35, 0.004),
                                             at(kHalfLength + 0.35, -kHalfWidth - 0.35, 0.004),
                                             at(-kHalfLength - 0.35, -kHalfWidth - 0.35, 0.004)},
                         material::shadow, 0.6F, 2 * kHalfLength + 0.7, 2 * kHalfWidth + 0.7);
  builder->end();
}

void build_bus(const WorldOptions& options, Scene* scene) {
  // Height in m above the ground.
  constexpr double kFloor = 0.3;
  const std::size_t first = scene->polygons.size();
  SceneBuilder builder(options, scene);
  // Rows of windows along it, boards with letters at both ends: there is much to be seen on it.
  const SceneBuilder::Face side{material::flats, 1.1F, 0, 0}, end{material::sign, 1.0F, 0, 0},
      top{material::concrete, 1.0F, 0, 0};
  builder.box(
      {Vec3(0, 0, kFloor), Vec2::UnitX(), 0.5 * kBusLength, 0.5 * kBusWidth, kBusHeight - kFloor},
      side, end, &top);
  const auto begin = scene->polygons.begin() + static_cast<std::ptrdiff_t>(first);
  scene->bus.assign(begin, scene->polygons.end());
  scene->polygons.erase(begin, scene->polygons.end());
}

void add_tree(SceneBuilder* builder, const Vec2& foot, double size_m, double lift_m,
              Random* random) {
  const double ground = builder->ground(foot.x()) + lift_m, trunk = 0.42 * size_m,
               crown = 0.78 * size_m, half = 0.36 * size_m * random->uniform(0.85, 1.15);
  const double turn = random->uniform(0, std::numbers::pi);
  const float tone = paint(random, 0.8, 1.25);
  builder->begin();
  const SceneBuilder::Face bark{material::bark, 1.0F, random->uniform(0, 1), 0};
  builder->box({raised(foot, ground - 0.2), Vec2(std::cos(turn), std::sin(turn)), 0.03 * size_m,
                0.03 * size_m, trunk + 0.3 * size_m},
               bark, bark, nullptr);
  for (int i = 0; i < 3; ++i) {
    const double angle = turn + i * std::numbers::pi / 3;
    const Vec2 d(half * std::cos(angle), half * std::sin(angle));
    const double z0 = ground + 0.28 * size_m, z1 = z0 + crown;
    builder->textured_quad(std::array<Vec3, 4>{raised(foot - d, z0), raised(foot + d, z0),
                                               raised(foot + d, z1), raised(foot - d, z1)},
                           material::foliage, tone * (0.92F + 0.1F * static_cast<float>(i)),
                           2 * half, crown);
  }
  builder->end();
}

void add_power_pole(SceneBuilder* builder, const Lot& lot) {
  const Vec2 foot = lot.at(0, kRoadHalf + 0.5);
  const double ground = builder->ground(foot.x()) + kKerb;
  const SceneBuilder::Face wood{material::bark, 1.3F, 0, 0};
  builder->begin();
  builder->box({raised(foot, ground - 0.1), lot.along, 0.13, 0.13, 8.6}, wood, wood, nullptr);
  builder->box({raised(foot, ground + 7.6), lot.outward, 1.1, 0.06, 0.14}, wood, wood, &wood);
  builder->box({raised(foot + 0.2 * lot.along, ground + 6.4), lot.along, 0.22, 0.22, 0.8},
               {material::concrete, 1, 0, 0}, {material::concrete, 1, 0, 0}, nullptr);
  builder->end();
}

void add_sign(SceneBuilder* builder, const Vec2& foot, const Vec2& facing, int board) {
  const double ground = builder->ground(foot.x()) + kKerb;
  // Right of the sign as seen from the front.
  const Vec2 right(-facing.y(), facing.x());
  const SceneBuilder::Face steel{material::concrete, 0.9F, 0, 0};
  builder->begin();
  builder->box({raised(foot - 0.05 * facing, ground - 0.1), right, 0.035, 0.035, 2.9}, steel, steel,
               nullptr);
  const double half = 0.38, z0 = ground + 2.05;
  builder->flat(
      std::array<Vec3, 4>{raised(foot - half * right, z0), raised(foot + half * right, z0),
                          raised(foot + half * right, z0 + 2 * half),
                          raised(foot - half * right, z0 + 2 * half)},
      {material::sign, 1.1F, board % 2 == 0 ? 0.12 : 1.12, board / 2 == 0 ? 0.12 : 1.12});
  builder->end();
}

void add_flats(SceneBuilder* builder, const Vec2& centre, double half_length, double half_width,
               int storeys, Random* random) {
  const double ground = builder->ground(centre.x()) - 2.0;
  const float tone = paint(random, 0.75, 1.15);
  const SceneBuilder::Face face{material::flats, tone, 3.0 * random->below(8), -2.0},
      top{material::concrete, 0.8F, 0, 0};
  const double turn = random->uniform(-0.3, 0.3);
  builder->begin();
  builder->box({raised(centre, ground), Vec2(std::cos(turn), std::sin(turn)), half_length,
                half_width, storeys * kStorey + 2.6},
               face, face, &top);
  builder->end();
}

void add_tree_line(SceneBuilder* builder, const Vec2& a, const Vec2& b, double height_m,
                   Random* random) {
  const double za = builder->ground(a.x()) - 0.8, zb = builder->ground(b.x()) - 0.8;
  builder->begin();
  builder->textured_quad(std::array<Vec3, 4>{raised(a, za), raised(b, zb), raised(b, zb + height_m),
                                             raised(a, za + height_m)},
                         // The height is less than the texture's, which wraps around.
                         material::tree_line, paint(random, 0.75, 1.2), 64.0, 1.06 * height_m);
  builder->end();
}

}  // namespace vergence::mock
