#pragma once
#include "core/camera/camera.hpp"
#include "core/features/mask.hpp"
#include "core/features/patch.hpp"

namespace vergence::features {

/// Position of a left patch in another camera: its pixel for every inverse depth along the left
/// ray.
struct EpipolarCurve {
  const Camera* camera = nullptr;
  Transform T_camera_left{};
  /// Left ray (x, y, 1).
  Vec3 ray{};

  /// Projects the point at inverse depth rho (1/m, of z in left; 0 is infinity). Not ok if it is
  /// behind the camera or outside its lens model.
  [[nodiscard]] ProjectStatus at(double rho, Vec2* pixel, Mat23* J) const noexcept {
    return camera->project(T_camera_left.R * ray + rho * T_camera_left.t, pixel, J);
  }
};

struct EpipolarSearchOptions {
  /// End of the range in 1/m, which begins at infinity; earlier if the curve leaves the image.
  double rho_last = 1.0;
  /// Half width of the band around the curve in px of the level, at most 2.
  int band = 1;
  /// Minimum correlation of the 8×8 px compared.
  float min_zncc = kMinZncc;
  /// Ratio (1 − best) / (1 − second best) above which the match is ambiguous.
  float unique = 0.85F;
  /// Mask of the searched image; may be null.
  const Mask* mask = nullptr;
};

enum class SearchStatus : std::uint8_t { ok, off_image, uncorrelated, ambiguous };

struct SearchResult {
  SearchStatus status = SearchStatus::off_image;
  /// Inverse depth of the best position's foot on the curve, in 1/m.
  double rho = 0;
  /// Pixel of level 0, rounded to whole pixels of the searched level.
  Vec2 pixel{};
  float zncc = 0;
};

/// Maximum number of positions along a curve: half of a 640 px wide level 1.
inline constexpr int kMaxSearchSteps = 320;

/// Compares the middle 8×8 px of level 1 of the patch along the curve, by normalised correlation in
/// integers. If the curve is longer there than kMaxSearchSteps, a coarser level is searched,
/// because steps above a pixel miss matches.
[[nodiscard]] SearchResult search_along(const Patch& patch, const Pyramid& image,
                                        const EpipolarCurve& curve,
                                        const EpipolarSearchOptions& options) noexcept;

/// Finds the inverse depth whose pixel on the curve is nearest to an observed one, by Gauss–Newton
/// from `rho`. Returns the remaining distance in px, or a negative value if it failed.
[[nodiscard]] double fit_inverse_depth(const EpipolarCurve& curve, const Vec2& observed,
                                       double* rho, double* sigma_rho_per_px) noexcept;

}  // namespace vergence::features
