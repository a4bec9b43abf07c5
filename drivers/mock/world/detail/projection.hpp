#pragma once
#include <vector>

#include "core/camera/camera.hpp"
#include "core/math/se3.hpp"
#include "drivers/mock/world/detail/scene.hpp"
#include "drivers/mock/world/detail/tile_kernel.hpp"

namespace vergence::mock {

/// Rays of a camera's pixels in tiles of 16 x 16, tile by tile in rows, with the bounds of each
/// tile. Pixels outside the image, or without a ray in the lens model, repeat the nearest valid
/// ray.
struct RayTiles {
  explicit RayTiles(const Camera& camera);

  struct Bounds {
    float x0, x1, y0, y1;
  };
  /// Numbers of tiles.
  int columns = 0, rows = 0;
  std::vector<float> x, y;
  /// Bounds by tile.
  std::vector<Bounds> bounds;
  /// Bounds of all tiles in a column or row of tiles.
  std::vector<Bounds> column_bounds, row_bounds;
  Bounds all{};
};

/// View of one pose: the polygons in front of the camera and the candidates of every tile.
class Projection {
 public:
  /// `T_camera_bus` is null if there is no bus.
  void build(const Scene& scene, const RayTiles& tiles, const Camera& camera,
             const Transform& T_camera_enu, const Transform* T_camera_bus, bool bayer);

  [[nodiscard]] std::span<const ProjectedPolygon> polygons() const noexcept { return polygons_; }
  [[nodiscard]] std::span<const Candidate> candidates(std::size_t tile) const noexcept {
    return candidates_[tile];
  }

 private:
  void allocate(const Scene& scene, const RayTiles& tiles);
  [[nodiscard]] bool add(const Scene& scene, const Polygon& polygon, const RayTiles& tiles,
                         const Camera& camera, const Transform& T_camera_enu, bool bayer);
  void bin(const ProjectedPolygon& polygon, std::int32_t index, const RayTiles& tiles,
           const RayTiles::Bounds& box, float slope);

  std::vector<ProjectedPolygon> polygons_;
  std::vector<std::vector<Candidate>> candidates_;
};

}  // namespace vergence::mock
