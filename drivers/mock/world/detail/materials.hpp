#pragma once
#include <cstdint>

#include "drivers/mock/world/detail/scene.hpp"

namespace vergence::mock {

inline constexpr double kFacadeWidth = 12.0;   // m: a facade's picture is one lot wide …
inline constexpr double kFacadeHeight = 12.0;  // … and four storeys of 3 m high
inline constexpr double kStorey = 3.0;         // m

/// Index into Scene::materials; facades come first, kFacades of them.
inline constexpr int kFacades = 7;
namespace material {
enum Index : int {
  side_wall = kFacades,
  flats,  // tall blocks: 24 m x 24 m
  roof,
  asphalt,
  pavement,
  grass,
  paint,     // road markings
  concrete,  // kerbs, poles
  foliage,
  bark,
  car_side,  // 4.2 m x 1.5 m
  car_end,   // 1.8 m x 1.5 m
  car_top,
  hedge,
  fence,
  tree_line,  // 64 m x 16 m
  hills,      // 2048 m x 128 m
  clouds,
  sign,    // 2 m x 2 m: four boards
  shadow,  // 1 x 1 units
};
}  // namespace material

/// Paints every texture and fills scene->materials in the order above. `detail` as in WorldOptions.
void paint_materials(std::uint64_t seed, int detail, Scene* scene);

/// The seven house fronts and the plain side wall, one after the other (facades.cpp).
Canvas paint_facade(int kind, std::uint64_t seed, int detail);
Canvas paint_side_wall(std::uint64_t seed, int detail);
Canvas paint_flats(std::uint64_t seed, int detail);

}  // namespace vergence::mock
