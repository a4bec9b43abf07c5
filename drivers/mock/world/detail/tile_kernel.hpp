#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace vergence::mock {

inline constexpr int kTile = 16;  // px, width and height; one to four SIMD packets a row
inline constexpr int kTilePixels = kTile * kTile;
inline constexpr float kEdgeReach = 1.0F;  // px: an edge fades over as much to each side
inline constexpr int kLayers =
    4;  // surfaces kept per pixel: an edge, two leaves of a tree, what is behind

/// A polygon as one frame sees it. With d = (x, y, 1) the ray of a pixel, all linear in d:
///   inverse depth    1/Z = q · d          (X = Z d lies in the plane)
///   texture          u = (U · d)/(q · d), v likewise, texels
///   edge i           E_i · d = signed distance to the edge in pixels, inside positive
struct ProjectedPolygon {
  std::array<std::array<float, 3>, 4> edge{};
  std::array<float, 3> q{}, u{}, v{};
  std::array<std::array<float, 2>, 2>
      gain{};  // [row parity][column parity]: a Bayer pattern's filters, or one grey gain
  std::int32_t texture = 0, log2_width = 0, log2_height = 0;
  std::int32_t opacity = -1, opacity_log2_width = 0,
               opacity_log2_height = 0;  // opacity texture, same (u, v) scaled by its size
  float opacity_scale_u = 1.0F, opacity_scale_v = 1.0F;
};

/// A polygon that may be seen in a tile, with bounds on its inverse depth there.
struct Candidate {
  std::int32_t polygon = 0;
  float q_max = 0, q_min = 0;  // over the tile and a pixel around it
  float slope = 0;             // of q, per pixel
  bool covers = false;         // every pixel of the tile is inside and it is solid
};

struct TileInput {
  const float* ray_x = nullptr;  // kTilePixels, rows of kTile
  const float* ray_y = nullptr;
  std::span<const Candidate> candidates;  // by q_max, nearest first
  std::span<const ProjectedPolygon> polygons;
  const std::int32_t* texture_words = nullptr;
  float pixel_x = 0, pixel_y = 0;  // ray units per pixel: 1/fx, 1/fy
  float haze_per_m = 0;  // 1/m: brightness → haze with distance t as 1/(1 + t·haze_per_m)
  float haze = 0;        // grey levels
};

/// Brightness of a tile's pixels before the lens and the sensor, grey levels at unit exposure,
/// added times `weight` to out (rows of out_stride floats). Pure function of its input; chosen at
/// run time for the machine's SIMD.
void shade_tile(const TileInput& in, float weight, float* out, std::ptrdiff_t out_stride) noexcept;

/// Response of a sensor to brightness.
struct SensorInput {
  const float* ray_x = nullptr;  // kTilePixels, rows of kTile
  const float* ray_y = nullptr;
  float exposure = 1.0F;  // gain on brightness
  float vignetting = 0;   // brightness times 1/(1 + vignetting·(x² + y²))²; 1 is the cos⁴ law
  float shot = 0;         // variance per grey level
  float read_variance = 0;   // grey levels²
  float noise_scale = 1.0F;  // 0: none
  std::uint32_t seed = 0;    // of this frame and camera
};

/// Brightness → 8-bit pixels of one tile: vignetting, exposure, noise, rounding, saturation.
/// `first_pixel` numbers the tile's pixels for the noise. Writes columns × rows pixels only.
void expose_tile(const SensorInput& in, const float* brightness, std::ptrdiff_t brightness_stride,
                 std::uint32_t first_pixel, int columns, int rows, std::uint8_t* out,
                 std::ptrdiff_t out_stride) noexcept;

}  // namespace vergence::mock
