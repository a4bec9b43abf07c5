#pragma once
#include "core/camera/camera.hpp"
#include "core/features/mask.hpp"
#include "core/features/patch.hpp"

namespace vergence::features {

/// Where a left patch may lie in another camera: its pixel for every inverse depth along the left
/// ray.
struct EpipolarCurve {
  const Camera* camera = nullptr;  // the other camera
  Transform T_camera_left{};
  Vec3 ray{};  // (x, y, 1) in left

  /// Pixel at inverse depth rho (1/m, of z in left; 0: infinity). Not ok: behind the camera or
  /// beyond its lens.
  [[nodiscard]] ProjectStatus at(double rho, Vec2* pixel, Mat23* J) const noexcept {
    return camera->project(T_camera_left.R * ray + rho * T_camera_left.t, pixel, J);
  }
};

struct EpipolarSearchOptions {
  int level = 1;           // pyramid level searched; a coarser one where the curve is longer there
                           // than kMaxSearchSteps: steps of more than a pixel pass matches by
  double rho_first = 0.0;  // 1/m, start of the range; may be negative to ask for exchanged cameras
  double rho_last = 1.0;   // 1/m, its end, or before it where the curve leaves the image
  int band = 1;            // px of the level to each side of the curve, 2 at most
  float min_zncc = 0.7F;   // of the 8×8 px compared
  float unique = 0.85F;    // (1 − best) / (1 − second best): above it the match is ambiguous
  const Mask* mask =
      nullptr;  // of the image searched: the patch is not there; null: it may be anywhere
};

enum class SearchStatus : std::uint8_t { ok, off_image, uncorrelated, ambiguous };

struct SearchResult {
  SearchStatus status = SearchStatus::off_image;
  double rho = 0;  // 1/m of the best position's foot on the curve
  Vec2 pixel{};    // level 0, whole pixels of the level searched
  float zncc = 0;
};

inline constexpr int kMaxSearchSteps =
    320;  // positions along a curve: half of a 640 px wide level 1

/// Compares the patch's middle 8×8 px of one level along the curve, by normalised correlation in
/// integers.
[[nodiscard]] SearchResult search_along(const Patch& patch, const Pyramid& image,
                                        const EpipolarCurve& curve,
                                        const EpipolarSearchOptions& options) noexcept;

/// The inverse depth whose pixel on the curve is nearest to an observed one: Gauss–Newton from
/// `rho`. Returns the distance left, px (how far off the curve the observation lies; signed along
/// the normal is not kept); < 0: failed.
[[nodiscard]] double fit_inverse_depth(const EpipolarCurve& curve, const Vec2& observed,
                                       double* rho, double* sigma_rho_per_px) noexcept;

}  // namespace vergence::features
