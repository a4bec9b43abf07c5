#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "core/camera/camera.hpp"
#include "core/math/se3.hpp"
#include "drivers/mock/world/kinds.hpp"
#include "drivers/mock/world/world.hpp"

namespace vergence::mock {

/// Parameters of one image.
struct RenderRequest {
  /// Exposure relative to the world's nominal daylight; 0 is a covered lens.
  double exposure = 1.0;
  /// Factor v of brightness · 1/(1 + v·r²)² with r the tangent of the angle to the axis; 1 gives
  /// the cos⁴ law, 0 none.
  double vignetting = 0.5;
  /// Variance per grey level; a 12 ke⁻ well on 255 levels gives 255/12000.
  double shot_noise = 0.02;
  /// Standard deviation in grey levels.
  double read_noise = 0.6;
  /// Different for every frame and camera; 0 turns all noise off.
  std::uint32_t noise_seed = 0;
};

/// Image formation of one simulated camera: casts a ray per pixel through the lens model into a
/// world.
///
/// Method     Rays in SIMD packets against the polygons binned to 16 x 16 tiles. Edges and textures
///            are prefiltered over a pixel, so images move smoothly at sub-pixel steps without
///            super-sampling.
/// Ownership  Shares the world. The caller owns the output memory.
/// Threads    One thread per renderer; any number of renderers per world.
/// Memory     Work buffers grow to the largest frame.
/// Units      T_camera_enu: p_camera = T_camera_enu · p_enu in metres; camera x right, y down, z
///            forward.
/// Errors     The constructor throws std::invalid_argument for an empty image size.
class Renderer {
 public:
  Renderer(std::shared_ptr<const World> world, const Camera& camera,
           Pattern pattern = Pattern::grey);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Renders an image of width x height bytes with rows `stride` apart. Several poses during the
  /// exposure are averaged (motion blur); at least one is required. `T_camera_bus` has the bus at
  /// each pose, or is empty.
  void render(std::span<const Transform> T_camera_enu, const RenderRequest& shot, std::uint8_t* out,
              std::ptrdiff_t stride, std::span<const Transform> T_camera_bus = {});
  void render(const Transform& T_camera_enu, const RenderRequest& shot, std::uint8_t* out,
              std::ptrdiff_t stride) {
    render(std::span(&T_camera_enu, 1), shot, out, stride);
  }

  [[nodiscard]] const Camera& camera() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vergence::mock
