#include "drivers/mock/world/detail/projection.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::mock {
namespace {

using Bounds = RayTiles::Bounds;

/// Distance in m at which polygons are cut, only to find the tiles that they touch.
constexpr double kNearest = 0.05;
/// Objects with a smaller bounding radius in px are not drawn.
constexpr double kSmallest = 0.35;
/// A plane nearer to the eye than this in m is seen edge-on.
constexpr double kFlat = 1e-4;

Bounds empty() noexcept { return {1e30F, -1e30F, 1e30F, -1e30F}; }

void grow(Bounds& b, float x, float y) noexcept {
  b.x0 = std::min(b.x0, x);
  b.x1 = std::max(b.x1, x);
  b.y0 = std::min(b.y0, y);
  b.y1 = std::max(b.y1, y);
}
void grow(Bounds& b, const Bounds& o) noexcept {
  grow(b, o.x0, o.y0);
  grow(b, o.x1, o.y1);
}

bool overlaps(const Bounds& a, const Bounds& b) noexcept {
  return a.x0 <= b.x1 && a.x1 >= b.x0 && a.y0 <= b.y1 && a.y1 >= b.y0;
}

/// Range of a · (x, y, 1) over a rectangle.
struct Range {
  float lo, hi;
};
Range range(const std::array<float, 3>& a, const Bounds& b) noexcept {
  const float x0 = a[0] * b.x0, x1 = a[0] * b.x1, y0 = a[1] * b.y0, y1 = a[1] * b.y1;
  return {a[2] + std::min(x0, x1) + std::min(y0, y1), a[2] + std::max(x0, x1) + std::max(y0, y1)};
}

std::array<float, 3> floats(const Vec3& v) noexcept {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Bounds of the part of a polygon in front of the camera; empty when there is none.
Bounds ray_bounds(const std::array<Vec3, 4>& corners, int count) noexcept {
  Bounds box = empty();
  const auto put = [&](const Vec3& p) {
    grow(box, static_cast<float>(p.x() / p.z()), static_cast<float>(p.y() / p.z()));
  };
  for (int i = 0; i < count; ++i) {
    const Vec3& a = corners[static_cast<std::size_t>(i)];
    const Vec3& b = corners[static_cast<std::size_t>((i + 1) % count)];
    if (a.z() >= kNearest) put(a);
    if ((a.z() >= kNearest) != (b.z() >= kNearest))
      put(a + (kNearest - a.z()) / (b.z() - a.z()) * (b - a));
  }
  return box;
}

/// The ray of a pixel, or of the nearest point towards the principal point that has one.
Vec3 pixel_ray(const Camera& camera, Vec2 pixel) noexcept {
  const Vec2 centre(camera.intrinsics().cx, camera.intrinsics().cy);
  Vec3 ray(0, 0, 1);
  // 0.97^64 = 0.14 is well inside any lens.
  for (int i = 0; i < 64; ++i) {
    if (camera.unproject(pixel, &ray)) return ray;
    pixel = centre + 0.97 * (pixel - centre);
  }
  return ray;
}

}  // namespace

RayTiles::RayTiles(const Camera& camera) {
  const int width = camera.intrinsics().width, height = camera.intrinsics().height;
  columns = (width + kTile - 1) / kTile;
  rows = (height + kTile - 1) / kTile;
  const std::size_t tiles = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  x.resize(tiles * kTilePixels);
  y.resize(tiles * kTilePixels);
  bounds.assign(tiles, empty());
  column_bounds.assign(static_cast<std::size_t>(columns), empty());
  row_bounds.assign(static_cast<std::size_t>(rows), empty());
  all = empty();
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const std::size_t tile = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                               static_cast<std::size_t>(c);
      for (int k = 0; k < kTilePixels; ++k) {
        const Vec2 pixel(std::min(c * kTile + k % kTile, width - 1),
                         std::min(r * kTile + k / kTile, height - 1));
        const Vec3 ray = pixel_ray(camera, pixel);
        const std::size_t at = tile * kTilePixels + static_cast<std::size_t>(k);
        x[at] = static_cast<float>(ray.x());
        y[at] = static_cast<float>(ray.y());
        grow(bounds[tile], x[at], y[at]);
      }
      grow(column_bounds[static_cast<std::size_t>(c)], bounds[tile]);
      grow(row_bounds[static_cast<std::size_t>(r)], bounds[tile]);
      grow(all, bounds[tile]);
    }
}

/// For whatever a later view shows, its pages touched: a drive takes no more memory on its way.
void Projection::allocate(const Scene& scene, const RayTiles& tiles) {
  // Usual number of polygons of a tile.
  constexpr std::size_t kUsual = 64;
  polygons_.resize(scene.polygons.size() + scene.bus.size());
  candidates_.resize(tiles.bounds.size());
  for (auto& list : candidates_) list.resize(kUsual);
}

void Projection::build(const Scene& scene, const RayTiles& tiles, const Camera& camera,
                       const Transform& T_camera_enu, const Transform* T_camera_bus, bool bayer) {
  if (candidates_.size() != tiles.bounds.size()) allocate(scene, tiles);
  polygons_.clear();
  for (auto& list : candidates_) list.clear();
  const double f = std::max(camera.intrinsics().fx, camera.intrinsics().fy);
  const double half_angle =
      std::atan(std::hypot(std::max(std::abs(tiles.all.x0), std::abs(tiles.all.x1)),
                           std::max(std::abs(tiles.all.y0), std::abs(tiles.all.y1))));
  for (const Object& object : scene.objects) {
    const Vec3 centre = T_camera_enu * object.centre;
    const double distance = centre.norm();
    if (distance > object.radius) {
      if (f * object.radius < kSmallest * distance) continue;
      const double angle = std::acos(std::clamp(centre.z() / distance, -1.0, 1.0));
      if (angle > half_angle + std::asin(object.radius / distance)) continue;
    }
    for (std::size_t i = object.first; i < object.first + object.count; ++i)
      (void)add(scene, scene.polygons[i], tiles, camera, T_camera_enu, bayer);
  }
  if (T_camera_bus != nullptr)
    for (const Polygon& polygon : scene.bus)
      (void)add(scene, polygon, tiles, camera, *T_camera_bus, bayer);
  for (auto& list : candidates_) {
    // Inverse depth that is not exceeded by anything behind it that counts.
    float closed = 0;
    for (const Candidate& c : list)
      if (c.covers) closed = std::max(closed, c.q_min);
    std::erase_if(list, [closed](const Candidate& c) { return c.q_max < closed; });
    std::sort(list.begin(), list.end(), [](const Candidate& a, const Candidate& b) {
      return a.q_max > b.q_max || (a.q_max == b.q_max && a.polygon < b.polygon);
    });
  }
}

bool Projection::add(const Scene& scene, const Polygon& polygon, const RayTiles& tiles,
                     const Camera& camera, const Transform& T_camera_enu, bool bayer) {
  const std::size_t count = static_cast<std::size_t>(polygon.count);
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < count; ++i) corners[i] = T_camera_enu * polygon.corners[i];
  const Vec3 normal = T_camera_enu.R * polygon.normal;
  // Distance of the plane along its normal from the eye; negative if the front is seen.
  const double height = normal.dot(corners[0]);
  if (std::abs(height) < kFlat || (height > 0 && !polygon.two_sided)) return false;

  Bounds box = ray_bounds(corners, polygon.count);
  const double fx = camera.intrinsics().fx, fy = camera.intrinsics().fy;
  const float margin_x = static_cast<float>(2.0 / fx), margin_y = static_cast<float>(2.0 / fy);
  box = {box.x0 - margin_x, box.x1 + margin_x, box.y0 - margin_y, box.y1 + margin_y};
  if (!overlaps(box, tiles.all)) return false;

  ProjectedPolygon out;
  const Vec3 q = normal / height;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i >= count) {
      // Every point is inside such an edge.
      out.edge[i] = {0, 0, 1};
      continue;
    }
    // The plane through the eye and the edge; inside is where X · m > 0. Holds also for corners
    // behind the eye.
    Vec3 m = corners[i].cross(corners[(i + 1) % count]);
    if (height < 0) m = -m;
    const double per_pixel = std::hypot(m.x() / fx, m.y() / fy);
    out.edge[i] = floats(m / std::max(per_pixel, 1e-9 * m.norm() + 1e-300));
  }
  const Material& material = scene.materials[static_cast<std::size_t>(polygon.material)];
  const Vec3 origin = T_camera_enu * polygon.texture_origin;
  const auto texture_row = [&](const Vec3& axis) {
    const Vec3 s = T_camera_enu.R * axis;
    // s · (Z d − origin) = Z (s − (s·origin) q) · d.
    return floats(s - s.dot(origin) * q);
  };
  out.q = floats(q);
  out.u = texture_row(polygon.axis_u);
  out.v = texture_row(polygon.axis_v);
  const Tint& tint = material.tint;
  const float l = polygon.light;
  if (bayer)
    out.gain = {{{l * tint.green, l * tint.blue}, {l * tint.red, l * tint.green}}};
  else
    out.gain = {{{l * tint.grey, l * tint.grey}, {l * tint.grey, l * tint.grey}}};
  out.texture = material.brightness.base;
  out.log2_width = material.brightness.log2_width;
  out.log2_height = material.brightness.log2_height;
  out.opacity = material.opacity.base;
  if (out.opacity >= 0) {
    out.opacity_log2_width = material.opacity.log2_width;
    out.opacity_log2_height = material.opacity.log2_height;
    out.opacity_scale_u =
        std::ldexp(1.0F, material.opacity.log2_width - material.brightness.log2_width);
    out.opacity_scale_v =
        std::ldexp(1.0F, material.opacity.log2_height - material.brightness.log2_height);
  }
  const auto index = static_cast<std::int32_t>(polygons_.size());
  polygons_.push_back(out);
  bin(out, index, tiles, box, kEdgeReach * static_cast<float>(std::hypot(q.x() / fx, q.y() / fy)));
  return true;
}

void Projection::bin(const ProjectedPolygon& polygon, std::int32_t index, const RayTiles& tiles,
                     const Bounds& box, float slope) {
  int r0 = 0, r1 = tiles.rows - 1, c0 = 0, c1 = tiles.columns - 1;
  while (r0 <= r1 && tiles.row_bounds[static_cast<std::size_t>(r0)].y1 < box.y0) ++r0;
  while (r1 >= r0 && tiles.row_bounds[static_cast<std::size_t>(r1)].y0 > box.y1) --r1;
  while (c0 <= c1 && tiles.column_bounds[static_cast<std::size_t>(c0)].x1 < box.x0) ++c0;
  while (c1 >= c0 && tiles.column_bounds[static_cast<std::size_t>(c1)].x0 > box.x1) --c1;
  for (int r = r0; r <= r1; ++r)
    for (int c = c0; c <= c1; ++c) {
      const std::size_t tile =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(tiles.columns) +
          static_cast<std::size_t>(c);
      const Bounds& b = tiles.bounds[tile];
      if (!overlaps(b, box)) continue;
      const Range q = range(polygon.q, b);
      if (q.hi <= 0) continue;
      bool inside = q.lo > 0 && polygon.opacity < 0, outside = false;
      for (const auto& edge : polygon.edge) {
        const Range e = range(edge, b);
        outside = outside || e.hi <= -kEdgeReach;
        inside = inside && e.lo >= kEdgeReach;
      }
      if (!outside) candidates_[tile].push_back({index, q.hi + slope, q.lo - slope, slope, inside});
    }
}

}  // namespace vergence::mock
