#pragma once
#include <cstdint>

#include "drivers/mock/world/detail/scene.hpp"

namespace vergence::mock {

inline constexpr double kFacadeWidth = 12.0;   // m: a facade's picture is one lot wide …
inline constexpr double kFacadeHeight = 12.0;  // … and four storeys of 3 m high
inline constexpr double kStorey = 3.0;         // m

/// Index into Scene::materials; facades come first, kFacades of them.
inline constexpr int kFacades = 7;
enum MaterialIndex : int {
  kSideWall = kFacades,
  kFlats,  // tall blocks: 24 m x 24 m
  kRoof,
  kAsphalt,
  kPavement,
  kGrass,
  kPaint,     // road markings
  kConcrete,  // kerbs, poles
  kFoliage,
  kBark,
  kCarSide,  // 4.2 m x 1.5 m
  kCarEnd,   // 1.8 m x 1.5 m
  kCarTop,
  kHedge,
  kFence,
  kTreeLine,  // 64 m x 16 m
  kHills,     // 2048 m x 128 m
  kClouds,
  kSign,    // 2 m x 2 m: four boards
  kShadow,  // 1 x 1 units
  kMaterials,
};

/// Paints every texture and fills scene->materials in the order above. `detail` as in WorldOptions.
void paint_materials(std::uint64_t seed, int detail, Scene* scene);

/// The seven house fronts and the plain side wall, one after the other (materials_facades.cpp).
Canvas paint_facade(int kind, std::uint64_t seed, int detail);
Canvas paint_side_wall(std::uint64_t seed, int detail);
Canvas paint_flats(std::uint64_t seed, int detail);

}  // namespace vergence::mock
