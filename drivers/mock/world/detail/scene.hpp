#pragma once
#include <vector>

#include "drivers/mock/world/detail/polygon.hpp"

namespace vergence::mock {

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
