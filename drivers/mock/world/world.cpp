#include "drivers/mock/world/world.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "drivers/mock/world/detail/materials.hpp"
#include "drivers/mock/world/detail/town.hpp"

namespace vergence::mock {
namespace {

const WorldOptions& checked(const WorldOptions& o) {
  const auto in = [](double v, double lo, double hi, const char* name) {
    if (!(v >= lo && v <= hi))
      throw std::invalid_argument(std::string("mock world: ") + name + " must be between " +
                                  std::to_string(lo) + " and " + std::to_string(hi));
  };
  in(o.texture_detail, 0, 2, "texture_detail");
  in(o.built_fraction, 0, 1, "built_fraction");
  in(o.car_fraction, 0, 1, "car_fraction");
  in(o.tree_fraction, 0, 1, "tree_fraction");
  in(o.hill_deg, 0, 5, "hill_deg");
  return o;
}

bool inside(const Polygon& polygon, const Vec3& p) noexcept {
  for (int i = 0; i < polygon.count; ++i) {
    const Vec3& a = polygon.corners[static_cast<std::size_t>(i)];
    const Vec3& b = polygon.corners[static_cast<std::size_t>((i + 1) % polygon.count)];
    if ((b - a).cross(p - a).dot(polygon.normal) < 0) return false;
  }
  return true;
}

}  // namespace

World::World(const WorldOptions& options)
    : options_(checked(options)), scene_(std::make_unique<Scene>()) {
  paint_materials(options_.seed, options_.texture_detail, scene_.get());
  build_town(options_, scene_.get());
  build_bus(options_, scene_.get());
}
World::World(const WorldOptions& options, std::unique_ptr<Scene> scene)
    : options_(checked(options)), scene_(std::move(scene)) {}
World::~World() = default;

double World::ground(double x, double) const noexcept {
  return smooth_ground(options_.hill_deg, x);
}
double World::ground_slope(double x) const noexcept {
  return smooth_ground_slope(options_.hill_deg, x);
}

std::optional<World::Hit> World::cast(const Vec3& origin, const Vec3& direction) const noexcept {
  constexpr double kNothing = 1e300;
  double solid = kNothing, veil = kNothing;
  for (const Object& object : scene_->objects) {
    const Vec3 to = object.centre - origin;
    // The ray passes by.
    if (to.cross(direction).squaredNorm() > object.radius * object.radius * direction.squaredNorm())
      continue;
    for (std::size_t i = object.first; i < object.first + object.count; ++i) {
      const Polygon& p = scene_->polygons[i];
      const double approach = p.normal.dot(direction);
      if (p.material == material::clouds || approach == 0 || (approach > 0 && !p.two_sided))
        continue;
      double& nearest =
          scene_->materials[static_cast<std::size_t>(p.material)].opacity.base < 0 ? solid : veil;
      const double t = p.normal.dot(p.corners[0] - origin) / approach;
      if (t > 0 && t < nearest && inside(p, origin + t * direction)) nearest = t;
    }
  }
  if (solid == kNothing) return std::nullopt;
  return Hit{solid, veil < solid};
}

}  // namespace vergence::mock
