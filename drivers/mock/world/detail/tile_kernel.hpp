#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace vergence::mock {

/// Width and height in px; one to four SIMD packets per row.
inline constexpr int kTile = 16;
inline constexpr int kTilePixels = kTile * kTile;
/// Width in px over which an edge fades on each side.
inline constexpr float kEdgeReach = 1.0F;
/// Surfaces kept per pixel, enough for an edge, two leaves of a tree and the background.
inline constexpr int kLayers = 4;

/// Polygon projected into a frame. With d = (x, y, 1) the ray of a pixel, all are linear in d:
///   inverse depth    1/Z = q · d          (X = Z d lies in the plane)
///   texture          u = (U · d)/(q · d), v likewise, texels
///   edge i           E_i · d = signed distance to the edge in pixels, inside positive
struct ProjectedPolygon {
  std::array<std::array<float, 3>, 4> edge{};
  std::array<float, 3> q{}, u{}, v{};
  /// Gains by [row parity][column parity]: the filters of a Bayer pattern, or one grey gain.
  std::array<std::array<float, 2>, 2> gain{};
  std::int32_t texture = 0, log2_width = 0, log2_height = 0;
  /// Opacity texture with the same (u, v), scaled by its size.
  std::int32_t opacity = -1, opacity_log2_width = 0, opacity_log2_height = 0;
  float opacity_scale_u = 1.0F, opacity_scale_v = 1.0F;
};

/// Polygon that may be visible in a tile, with bounds on its inverse depth there.
struct Candidate {
  std::int32_t polygon = 0;
  /// Bounds over the tile and a margin of one pixel.
  float q_max = 0, q_min = 0;
  /// Slope of q per pixel.
  float slope = 0;
  /// True if the polygon is solid and covers every pixel of the tile.
  bool covers = false;
};

struct TileInput {
  /// Arrays of kTilePixels, in rows of kTile.
  const float* ray_x = nullptr;
  const float* ray_y = nullptr;
  /// Ordered by q_max, nearest first.
  std::span<const Candidate> candidates;
  std::span<const ProjectedPolygon> polygons;
  const std::int32_t* texture_words = nullptr;
  /// Ray units per pixel, 1/fx and 1/fy.
  float pixel_x = 0, pixel_y = 0;
  /// In 1/m: brightness tends to `haze` with distance t as 1/(1 + t·haze_per_m).
  float haze_per_m = 0;
  /// In grey levels.
  float haze = 0;
};

/// Adds `weight` times the brightness of a tile's pixels, before lens and sensor and in grey levels
/// at unit exposure, to out (rows of out_stride floats). Depends only on its input; the SIMD
/// variant is chosen at run time.
void shade_tile(const TileInput& in, float weight, float* out, std::ptrdiff_t out_stride) noexcept;

/// Response of a sensor to brightness.
struct SensorInput {
  /// Arrays of kTilePixels, in rows of kTile.
  const float* ray_x = nullptr;
  const float* ray_y = nullptr;
  /// Gain on brightness.
  float exposure = 1.0F;
  /// Brightness is multiplied by 1/(1 + vignetting·(x² + y²))²; 1 gives the cos⁴ law.
  float vignetting = 0;
  /// Variance per grey level.
  float shot = 0;
  /// In grey levels².
  float read_variance = 0;
  /// 0 turns noise off.
  float noise_scale = 1.0F;
  /// Seed of this frame and camera.
  std::uint32_t seed = 0;
};

/// Converts brightness to the 8-bit pixels of one tile: vignetting, exposure, noise, rounding,
/// saturation. `first_pixel` numbers the tile's pixels for the noise. Writes only columns × rows
/// pixels.
void expose_tile(const SensorInput& in, const float* brightness, std::ptrdiff_t brightness_stride,
                 std::uint32_t first_pixel, int columns, int rows, std::uint8_t* out,
                 std::ptrdiff_t out_stride) noexcept;

}  // namespace vergence::mock
