#pragma once
#include <array>
#include <vector>

#include "core/math/types.hpp"
#include "drivers/mock/world/detail/texture.hpp"

namespace vergence::mock {

/// Colour as gains on the grey texture; grey cameras use `grey`.
struct Tint {
  float grey = 1.0F, red = 1.0F, green = 1.0F, blue = 1.0F;
};

/// Surface with its brightness, and opacity if it has holes.
struct Material {
  TextureRef brightness;
  /// A negative base means solid.
  TextureRef opacity;
  float texels_per_metre_u = 1.0F;
  float texels_per_metre_v = 1.0F;
  Tint tint;
};

/// A flat convex polygon of three or four corners in `enu`, metres, counter-clockwise seen from its
/// front.
struct Polygon {
  std::array<Vec3, 4> corners;
  int count = 4;
  /// Unit vector towards the front.
  Vec3 normal;
  bool two_sided = false;
  /// Index into Scene::materials.
  int material = 0;
  /// Point with (u, v) = (0, 0).
  Vec3 texture_origin;
  /// Axes in the plane: texels = axis · (p − origin), including texels per metre.
  Vec3 axis_u, axis_v;
  /// Gain on the texture's brightness: illumination times paint.
  float light = 1.0F;
};

/// Polygons that are culled together.
struct Object {
  std::size_t first = 0, count = 0;
  /// Centre of the bounding sphere, in m.
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};

/// All visible things, constant after construction.
struct Scene {
  TextureAtlas atlas;
  std::vector<Material> materials;
  std::vector<Polygon> polygons;
  std::vector<Object> objects;
  /// Polygons in the bus's own axes: x forward, y left, z up, origin on the ground below the middle
  /// of its floor.
  std::vector<Polygon> bus;
};

}  // namespace vergence::mock
