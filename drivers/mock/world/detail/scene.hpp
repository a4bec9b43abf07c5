#pragma once
#include <array>
#include <vector>

#include "core/math/types.hpp"
#include "drivers/mock/world/detail/texture.hpp"

namespace vergence::mock {

/// Colour as gains on the grey texture; grey cameras see `grey`.
struct Tint {
  float grey = 1.0F, red = 1.0F, green = 1.0F, blue = 1.0F;
};

/// A painted surface: brightness, and opacity where it has holes, with how many texels a metre
/// takes.
struct Material {
  TextureRef brightness;
  TextureRef opacity;  // base < 0: solid
  float texels_per_metre_u = 1.0F;
  float texels_per_metre_v = 1.0F;
  Tint tint;
};

/// A flat convex polygon of three or four corners in `enu`, metres, counter-clockwise seen from its
/// front.
struct Polygon {
  std::array<Vec3, 4> corners;
  int count = 4;
  Vec3 normal;  // unit, towards the front
  bool two_sided = false;
  int material = 0;     // index into Scene::materials
  Vec3 texture_origin;  // where (u, v) = (0, 0)
  Vec3 axis_u, axis_v;  // in the plane; texels = axis · (p − origin): texels per metre included
  float light = 1.0F;   // gain on the texture's brightness: illumination times this one's own paint
};

/// Polygons that are culled together.
struct Object {
  std::size_t first = 0, count = 0;
  Vec3 centre = Vec3::Zero();  // of the bounding sphere, m
  double radius = 0;
};

/// Everything there is to see, constant after construction.
struct Scene {
  TextureAtlas atlas;
  std::vector<Material> materials;
  std::vector<Polygon> polygons;
  std::vector<Object> objects;
  std::vector<Polygon>
      bus;  // in its own axes: x forward, y left, z up, the middle of its floor on the ground
};

}  // namespace vergence::mock
