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
};

}  // namespace vergence::mock
