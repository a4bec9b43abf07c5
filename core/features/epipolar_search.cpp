#include "core/features/epipolar_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/features/detail/correlate_kernel.hpp"

namespace vergence::features {
namespace {

using detail::Block;
using detail::kBlock;

// Positions along the curve times those across it.
constexpr int kPlaces = kMaxSearchSteps * 5;
constexpr int kMaxBand = 2;

Block middle_block(const Patch& patch, int level) noexcept {
  Block b;
  const auto& from = patch.pixels[static_cast<std::size_t>(level)];
  constexpr int kFirst = kPatchSide / 2 - kBlock / 2;
  float square = 0;
  for (int r = 0; r < kBlock; ++r) {
    std::memcpy(b.pixels + r * kBlock, from.data() + (kFirst + r) * kPatchSide + kFirst, kBlock);
    for (int c = 0; c < kBlock; ++c) {
      const float v = b.pixels[r * kBlock + c];
      b.sum += v;
      square += v * v;
    }
  }
  b.variance = static_cast<float>(kBlock * kBlock) * square - b.sum * b.sum;
  return b;
}

}  // namespace

SearchResult search_along(const Patch& patch, const Pyramid& image, const EpipolarCurve& curve,
                          const EpipolarSearchOptions& options) noexcept {
  SearchResult result;
  const int coarsest = std::min<int>(image.levels(), patch.levels) - 1;
  int level = std::min(1, coarsest);
  if (level < 0) return result;
  Vec2 first;
  if (curve.at(0, &first, nullptr) != ProjectStatus::ok) return result;
  Vec2 last = first;
  // The near end may be outside the image or the lens model; the range then ends where the curve
  // leaves it.
  double rho_last = 0;
  double step = options.rho_last;
  // Resolution of a thousandth of the range.
  constexpr int kBisections = 10;
  for (int i = 0; i <= kBisections; ++i, step *= 0.5) {
    Vec2 p;
    if (rho_last + step > options.rho_last ||
        curve.at(rho_last + step, &p, nullptr) != ProjectStatus::ok || !curve.camera->inside(p, 0))
      continue;
    rho_last += step;
    last = p;
  }
  if (rho_last == 0) return result;

  const double length = (last - first).norm();
  while (level < coarsest && std::ldexp(length, -level) > kMaxSearchSteps - 1) ++level;
  const ImageView& view = image.level(level);
  const double scale = std::ldexp(1.0, -level);
  const int steps = std::clamp(static_cast<int>(std::ceil(length * scale)), 1, kMaxSearchSteps - 1);
  const Vec2 along = (last - first).normalized();
  const bool horizontal = std::abs(along.x()) >= std::abs(along.y());
  const int band = std::clamp(options.band, 0, kMaxBand);
  const Block block = middle_block(patch, level);
  // The block's first pixel is kBlock/2 before the searched pixel; the anchor's offset in its pixel
  // moves with it.
  const Vec2 anchor = patch.offset[static_cast<std::size_t>(level)].cast<double>();

  struct Step {
    // Index along the curve, and pixel of the level.
    std::int16_t index, x, y;
  };
  std::array<Step, kMaxSearchSteps> kept;
  std::array<std::int32_t, kPlaces> offsets;
  int n = 0, places = 0;
  // Number of steps per chord of the curve. With a radius of curvature of 800 px of the level,
  // smaller than those recorded, the deviation L² / 8R is a hundredth of a pixel over eight steps.
  constexpr int kChord = 8;
  Vec2 p = first * scale - anchor, d = Vec2::Zero();
  for (int i = 0; i <= steps; ++i, p += d) {
    if (i % kChord == 0 && i < steps) {
      const int end = std::min(i + kChord, steps);
      Vec2 there;
      if (curve.at(rho_last * end / steps, &there, nullptr) != ProjectStatus::ok) break;
      d = (there * scale - anchor - p) / (end - i);
    }
    // Rounding towards zero is harmless, because negative values are outside.
    const int x = static_cast<int>(p.x() + 0.5), y = static_cast<int>(p.y() + 0.5);
    const int dx = horizontal ? 0 : band, dy = horizontal ? band : 0;
    if (x - dx < kBlock / 2 || y - dy < kBlock / 2 || x + dx + kBlock / 2 > view.width ||
        y + dy + kBlock / 2 > view.height)
      continue;
    if (options.mask != nullptr && options.mask->hides((Vec2(x, y) + anchor) / scale)) continue;
    kept[static_cast<std::size_t>(n++)] = {
        static_cast<std::int16_t>(i), static_cast<std::int16_t>(x), static_cast<std::int16_t>(y)};
    const std::ptrdiff_t across = horizontal ? view.stride : 1;
    const std::ptrdiff_t at = (y - kBlock / 2) * view.stride + (x - kBlock / 2);
    for (int b = -band; b <= band; ++b)
      offsets[static_cast<std::size_t>(places++)] = static_cast<std::int32_t>(at + b * across);
  }
  if (n == 0) return result;
  // Squared correlations.
  std::array<float, kPlaces> scores;
  static_assert(kPlaces % detail::kPlacesAtATime == 0);
  detail::correlate(block, view.data, view.stride, offsets.data(), places, scores.data());

  const int width = 2 * band + 1;
  const float best_square = detail::highest(scores.data(), places);
  const auto best = static_cast<int>(
      std::find(scores.begin(), scores.begin() + places, best_square) - scores.begin());
  const float best_score = std::sqrt(best_square);
  const Step& at = kept[static_cast<std::size_t>(best / width)];
  const int aside = best % width - band;
  // Distance in px of the level within which positions belong to the same peak.
  constexpr int kNeighbourhood = 3;
  const auto apart = [&](const Step& s) { return std::abs(s.index - at.index) > kNeighbourhood; };
  const auto before =
      static_cast<int>(std::find_if_not(kept.begin(), kept.begin() + n, apart) - kept.begin());
  int after = best / width;
  while (after < n && !apart(kept[static_cast<std::size_t>(after)])) ++after;
  const float second =
      std::sqrt(std::max(detail::highest(scores.data(), before * width),
                         detail::highest(scores.data() + after * width, (n - after) * width)));
  result.zncc = best_score;
  result.rho = rho_last * at.index / steps;
  result.pixel =
      (Vec2(at.x + (horizontal ? 0 : aside), at.y + (horizontal ? aside : 0)) + anchor) / scale;
  if (best_score < options.min_zncc)
    result.status = SearchStatus::uncorrelated;
  else if (1.F - best_score > options.unique * (1.F - second))
    result.status = SearchStatus::ambiguous;
  else
    result.status = SearchStatus::ok;
  return result;
}

double fit_inverse_depth(const EpipolarCurve& curve, const Vec2& observed, double* rho,
                         double* sigma_rho_per_px) noexcept {
  // The problem is nearly linear in inverse depth: two steps suffice, and lens distortion needs a
  // third.
  constexpr int kSteps = 4;
  double value = *rho;
  for (int i = 0; i < kSteps; ++i) {
    Vec2 p;
    Mat23 J;
    if (curve.at(value, &p, &J) != ProjectStatus::ok) return -1.0;
    const Vec2 d = J * curve.T_camera_left.t;
    const double information = d.squaredNorm();
    if (!(information > 1e-12)) return -1.0;
    value += d.dot(observed - p) / information;
    *sigma_rho_per_px = 1.0 / std::sqrt(information);
  }
  Vec2 p;
  if (curve.at(value, &p, nullptr) != ProjectStatus::ok) return -1.0;
  *rho = value;
  return (observed - p).norm();
}

}  // namespace vergence::features
