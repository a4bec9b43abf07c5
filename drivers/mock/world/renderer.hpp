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
  double exposure = 1.0;  // relative to the world's nominal daylight exposure; 0 is a covered lens
  double vignetting = 0.5;   // brightness · 1/(1 + vignetting·r²)², r = tan of the angle to the
                             // axis; 1: cos⁴ law, 0: none
  double shot_noise = 0.02;  // variance per grey level; a 12 ke⁻ well on 255 levels: 255/12000
  double read_noise = 0.6;   // grey levels, sigma
  std::uint32_t noise_seed = 0;  // a different one for every frame and camera; 0: no noise at all
};

/// One mock camera's image formation: casts a ray per pixel through the lens model into a world.
///
/// Method     Rays in SIMD packets against the polygons binned to 16 x 16 tiles. Edges and textures
///            are prefiltered over a pixel, so that a picture moves smoothly by any fraction of a
///            pixel; no super-sampling.
/// Ownership  The world is shared and outlives nothing: it is kept. Output memory is the caller's.
/// Threads    One thread per renderer; any number of renderers on one world.
/// Memory     Work buffers grow to the largest frame seen, then stay.
/// Units      T_camera_enu: p_camera = T_camera_enu · p_enu, metres; camera x right, y down, z
///            forward.
/// Errors     The constructor throws std::invalid_argument for an image without size. render()
///            cannot fail.
class Renderer {
 public:
  Renderer(std::shared_ptr<const World> world, const Camera& camera,
           Pattern pattern = Pattern::grey);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// One picture into width x height bytes, rows `stride` apart. Several poses are the camera's way
  /// during the exposure, averaged (motion blur); precondition: at least one. `T_camera_bus`: where
  /// the bus is at each of them, or nothing.
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
