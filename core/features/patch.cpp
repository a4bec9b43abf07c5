#include "core/features/patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <Eigen/LU>

#include "core/features/detail/align_kernel.hpp"

namespace vergence::features {
namespace {

// Index of the middle pixel.
constexpr int kHalf = kPatchSide / 2;
// Step in px of the level below which the alignment has settled, a tenth of its noise.
constexpr float kSettled = 0.01F;
// Minimum standard deviation of the window in grey levels, twice that of rounding (1/√12).
constexpr float kMinContrast = 0.6F;
// Minimum smaller eigenvalue over the window's pixels in grey levels² / px², six times the mean
// squared gradient of rounding (1/24).
constexpr float kMinHessian = 0.25F;

// Maximum number of steps per level.
constexpr int kMaxSteps = 12;

struct LevelOutcome {
  AlignStatus status;
  // Pixel of the level.
  float x, y;
  float zncc;
  // Standard deviation for one grey level of noise, in px of the level.
  float sigma;
};

LevelOutcome align_level(const detail::Window& w, const ImageView& image, float x, float y,
                         float max_shift) noexcept {
  constexpr float kPixels = kWindow * kWindow;
  constexpr float kHalfWindow = 0.5F * static_cast<float>(kWindow - 1);
  LevelOutcome out{AlignStatus::diverged, x, y, 0.F, 0.F};
  const float trace = 0.5F * (w.hxx + w.hyy);
  const float det = w.hxx * w.hyy - w.hxy * w.hxy;
  const float min_eigenvalue = trace - std::sqrt(std::max(0.F, trace * trace - det));
  if (!(w.variance_sum > kMinContrast * kMinContrast * kPixels) ||
      !(min_eigenvalue > kMinHessian * kPixels)) {
    out.status = AlignStatus::flat;
    return out;
  }
  out.sigma = 1.F / std::sqrt(min_eigenvalue);
  const float ixx = w.hyy / det, ixy = -w.hxy / det, iyy = w.hxx / det;
  const float start_x = x, start_y = y;
  // Vector loads read kWindowStride + 1 pixels of a row, which must not exceed the image's last
  // rows.
  const float last_x = static_cast<float>(image.width - kWindowStride - 2),
              last_y = static_cast<float>(image.height - kWindow - 2);
  detail::WindowSums s{};
  float image_variance = 0.F;
  // A level need not settle within the steps; the next finer one or the residual test
  // decides then.
  for (int step = 0; step < kMaxSteps; ++step) {
    const float left = out.x - kHalfWindow, top = out.y - kHalfWindow;
    if (!(left >= 0.F && top >= 0.F && left <= last_x && top <= last_y)) {
      out.status = AlignStatus::outside;
      return out;
    }
    const int ix = static_cast<int>(left), iy = static_cast<int>(top);
    detail::window_sums(w, image.data + iy * image.stride + ix, image.stride,
                        left - static_cast<float>(ix), top - static_cast<float>(iy), &s);
    image_variance = std::max(s.square - s.sum * s.sum / kPixels, 0.F);
    // A gain near zero or negative means that nothing here resembles the window, so a step would be
    // noise.
    const float gain = std::max(s.value / w.variance_sum,
                                0.3F * std::sqrt(image_variance / w.variance_sum) + 1e-3F);
    float dx = (ixx * s.steep_x + ixy * s.steep_y) / gain;
    float dy = (ixy * s.steep_x + iyy * s.steep_y) / gain;
    const float length = std::sqrt(dx * dx + dy * dy);
    // Maximum step in px of the level, above which the linear model does not hold.
    constexpr float kMaxStep = 3.F;
    if (length > kMaxStep) {
      dx *= kMaxStep / length;
      dy *= kMaxStep / length;
    }
    out.x -= dx;
    out.y -= dy;
    const float moved_x = out.x - start_x, moved_y = out.y - start_y;
    if (!(moved_x * moved_x + moved_y * moved_y <= max_shift * max_shift)) return out;
    if (length < kSettled) break;
  }
  out.status = AlignStatus::ok;
  const float norm = w.variance_sum * image_variance;
  out.zncc = norm > 1.F ? s.value / std::sqrt(norm) : 0.F;
  return out;
}

}  // namespace

bool cut_patch(const Pyramid& pyramid, const Vec2& at, Patch* patch) noexcept {
  patch->levels = 0;
  for (int l = 0; l < std::min(kPatchLevels, pyramid.levels()); ++l) {
    const ImageView& image = pyramid.level(l);
    const double scale = std::ldexp(1.0, -l);
    const Vec2 c = at * scale;
    const int ix = static_cast<int>(std::lround(c.x())), iy = static_cast<int>(std::lround(c.y()));
    if (ix < kHalf || iy < kHalf || ix + kHalf > image.width || iy + kHalf > image.height) break;
    const auto i = static_cast<std::size_t>(l);
    for (int r = 0; r < kPatchSide; ++r)
      std::memcpy(patch->pixels[i].data() + r * kPatchSide, image.row(iy - kHalf + r) + ix - kHalf,
                  kPatchSide);
    patch->offset[i] = {static_cast<float>(c.x() - ix), static_cast<float>(c.y() - iy)};
    ++patch->levels;
  }
  return patch->levels > 0;
}

AlignResult align(const Patch& patch, const Pyramid& image, const Vec2& predicted, const Mat2& A,
                  const AlignOptions& options) noexcept {
  AlignResult result;
  const double det = A.determinant();
  if (!(std::abs(det) > 0.05 && std::abs(det) < 20.0)) {
    result.status = AlignStatus::diverged;
    return result;
  }
  const Mat2 inverse = A.inverse();
  const float B[4] = {static_cast<float>(inverse(0, 0)), static_cast<float>(inverse(0, 1)),
                      static_cast<float>(inverse(1, 0)), static_cast<float>(inverse(1, 1))};
  const int coarsest = std::min({options.coarsest, patch.levels - 1, image.levels() - 1});
  Vec2 pixel = predicted;
  for (int l = std::max(coarsest, options.finest); l >= options.finest; --l) {
    const auto i = static_cast<std::size_t>(l);
    detail::Window window;
    detail::make_window(patch.pixels[i].data(), static_cast<float>(kHalf) + patch.offset[i].x(),
                        static_cast<float>(kHalf) + patch.offset[i].y(), B, &window);
    const double scale = std::ldexp(1.0, l);
    const LevelOutcome out = align_level(
        window, image.level(l), static_cast<float>(pixel.x() / scale),
        static_cast<float>(pixel.y() / scale), options.max_shift / static_cast<float>(scale));
    // A coarse level may be flat or outside the image although a finer one is not.
    if (out.status != AlignStatus::ok && l > options.finest) continue;
    result.status = out.status;
    result.zncc = out.zncc;
    result.sigma = out.sigma * static_cast<float>(scale);
    if (out.status == AlignStatus::ok || l == options.finest) {
      if (out.status != AlignStatus::ok) return result;
      pixel = {out.x * scale, out.y * scale};
    }
  }
  result.pixel = pixel;
  if ((pixel - predicted).norm() > options.max_shift)
    result.status = AlignStatus::diverged;
  else if (!(result.zncc >= options.min_zncc))
    result.status = AlignStatus::uncorrelated;
  return result;
}

}  // namespace vergence::features
