#pragma once
#include <cstdint>

#include "drivers/mock/world/detail/scene.hpp"

namespace vergence::mock {

/// A facade's texture is one lot wide and four storeys of 3 m high, in m.
inline constexpr double kFacadeWidth = 12.0;
inline constexpr double kFacadeHeight = 12.0;
inline constexpr double kStorey = 3.0;

/// Index into Scene::materials; the kFacades facades come first.
inline constexpr int kFacades = 7;
namespace material {
enum Index : int {
  side_wall = kFacades,
  /// Tall blocks of 24 m x 24 m.
  flats,
  roof,
  asphalt,
  pavement,
  grass,
  /// Road markings.
  paint,
  /// Kerbs and poles.
  concrete,
  foliage,
  bark,
  /// 4.2 m x 1.5 m.
  car_side,
  /// 1.8 m x 1.5 m.
  car_end,
  car_top,
  hedge,
  fence,
  /// 64 m x 16 m.
  tree_line,
  /// 2048 m x 128 m.
  hills,
  clouds,
  /// Four boards on 2 m x 2 m.
  sign,
  /// 1 x 1 units.
  shadow,
};
}  // namespace material

/// Paints every texture into scene->materials in the above order. `detail` as in WorldOptions.
void paint_materials(std::uint64_t seed, int detail, Scene* scene);

/// The seven house fronts and the plain side wall (facades.cpp).
Canvas paint_facade(int kind, std::uint64_t seed, int detail);
Canvas paint_side_wall(std::uint64_t seed, int detail);
Canvas paint_flats(std::uint64_t seed, int detail);

}  // namespace vergence::mock
