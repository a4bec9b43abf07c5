#include "drivers/mock/world/renderer.hpp"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>
#include <vector>

#include "drivers/mock/world/detail/projection.hpp"

namespace vergence::mock {
namespace {

/// On a clear day, half the contrast is left at 1.2 km.
constexpr float kHazePerMetre = 1.0F / 1200.0F;
/// Grey level of the sky above the horizon.
constexpr float kHaze = 205.0F;

}  // namespace

struct Renderer::Impl {
  Impl(std::shared_ptr<const World> w, const Camera& c, Pattern p)
      : world(std::move(w)), camera(c), pattern(p), tiles(c) {
    stride = static_cast<std::ptrdiff_t>(tiles.columns) * kTile;
    brightness.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(tiles.rows) *
                      kTile);
  }

  void add_pose(const Transform& T_camera_enu, const Transform* T_camera_bus, float weight) {
    const Scene& scene = world->scene();
    projection.build(scene, tiles, camera, T_camera_enu, T_camera_bus, pattern == Pattern::gbrg);
    TileInput in;
    in.polygons = projection.polygons();
    in.texture_words = scene.atlas.words();
    in.pixel_x = static_cast<float>(1.0 / camera.intrinsics().fx);
    in.pixel_y = static_cast<float>(1.0 / camera.intrinsics().fy);
    in.haze_per_m = kHazePerMetre;
    in.haze = kHaze;
    for (std::size_t tile = 0; tile < tiles.bounds.size(); ++tile) {
      in.ray_x = tiles.x.data() + tile * kTilePixels;
      in.ray_y = tiles.y.data() + tile * kTilePixels;
      in.candidates = projection.candidates(tile);
      shade_tile(in, weight, brightness.data() + offset(tile), stride);
    }
  }

  [[nodiscard]] std::ptrdiff_t offset(std::size_t tile) const noexcept {
    const auto columns = static_cast<std::size_t>(tiles.columns);
    return static_cast<std::ptrdiff_t>(tile / columns) * kTile * stride +
           static_cast<std::ptrdiff_t>(tile % columns) * kTile;
  }

  std::shared_ptr<const World> world;
  Camera camera;
  Pattern pattern;
  RayTiles tiles;
  Projection projection;
  /// Floats per row of brightness.
  std::ptrdiff_t stride = 0;
  std::vector<float> brightness;
};

namespace {

const Camera& checked(const Camera& camera) {
  const Intrinsics& k = camera.intrinsics();
  if (k.width <= 0 || k.height <= 0 || !(k.fx > 0) || !(k.fy > 0))
    throw std::invalid_argument(
        "mock camera: the image size and the focal lengths must be positive");
  return camera;
}

}  // namespace

Renderer::Renderer(std::shared_ptr<const World> world, const Camera& camera, Pattern pattern)
    : impl_(std::make_unique<Impl>(std::move(world), checked(camera), pattern)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const Camera& Renderer::camera() const noexcept { return impl_->camera; }

void Renderer::render(std::span<const Transform> T_camera_enu, const RenderRequest& shot,
                      std::uint8_t* out, std::ptrdiff_t stride,
                      std::span<const Transform> T_camera_bus) {
  assert(T_camera_bus.empty() || T_camera_bus.size() == T_camera_enu.size());
  Impl& m = *impl_;
  std::fill(m.brightness.begin(), m.brightness.end(), 0.0F);
  for (std::size_t i = 0; i < T_camera_enu.size(); ++i)
    m.add_pose(T_camera_enu[i], T_camera_bus.empty() ? nullptr : &T_camera_bus[i],
               1.0F / static_cast<float>(T_camera_enu.size()));

  SensorInput sensor;
  sensor.exposure = static_cast<float>(shot.exposure);
  sensor.vignetting = static_cast<float>(shot.vignetting);
  sensor.shot = static_cast<float>(shot.shot_noise);
  sensor.read_variance = static_cast<float>(shot.read_noise * shot.read_noise);
  sensor.noise_scale = shot.noise_seed != 0 ? 1.0F : 0.0F;
  sensor.seed = shot.noise_seed;
  const int width = m.camera.intrinsics().width, height = m.camera.intrinsics().height;
  for (std::size_t tile = 0; tile < m.tiles.bounds.size(); ++tile) {
    const int x0 = static_cast<int>(tile % static_cast<std::size_t>(m.tiles.columns)) * kTile;
    const int y0 = static_cast<int>(tile / static_cast<std::size_t>(m.tiles.columns)) * kTile;
    sensor.ray_x = m.tiles.x.data() + tile * kTilePixels;
    sensor.ray_y = m.tiles.y.data() + tile * kTilePixels;
    expose_tile(sensor, m.brightness.data() + m.offset(tile), m.stride,
                static_cast<std::uint32_t>(tile) * kTilePixels, std::min(kTile, width - x0),
                std::min(kTile, height - y0), out + y0 * stride + x0, stride);
  }
}

}  // namespace vergence::mock
