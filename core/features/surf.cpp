#include "core/features/surf.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

#include <Eigen/LU>

#include "core/features/detail/surf_descriptor.hpp"
#include "core/features/detail/surf_hessian.hpp"
#include "core/math/types.hpp"

namespace vergence::features {
namespace {

// Sigma per box size: boxes of 9 px approximate a Gaussian of 1.2 px.
constexpr float kSigmaOfSize = 1.2F / 9.F;
// Maximum offset of a parabola's top in samples or sizes; a farther one is no maximum here.
constexpr double kMaxOffset = 1.0;

/// Orders stronger points first, uniquely and independent of the heap.
bool stronger(const SurfPoint& a, const SurfPoint& b) noexcept {
  if (a.response != b.response) return a.response > b.response;
  if (a.y != b.y) return a.y < b.y;
  return a.x != b.x ? a.x < b.x : a.scale < b.scale;
}

/// Keeps the strongest points in a heap whose first element is the weakest.
void offer(const SurfPoint& p, BoundedVector<SurfPoint>* out) noexcept {
  if (out->push(p)) {
    std::push_heap(out->begin(), out->end(), stronger);
    return;
  }
  if (out->empty() || !stronger(p, (*out)[0])) return;
  std::pop_heap(out->begin(), out->end(), stronger);
  out->back() = p;
  std::push_heap(out->begin(), out->end(), stronger);
}

}  // namespace

/// Sampling grid of an octave: column i, row j is at (first + i · step, first + j · step).
struct Surf::Octave {
  Octave(int number, int width, int height) noexcept : step(1 << number) {
    const int half = size(kLayers - 1) / 2;
    first = (half + step - 1) / step * step;
    // The last position also has room for the largest boxes.
    columns = width > first + half ? (width - 1 - half - first) / step + 1 : 0;
    rows = height > first + half ? (height - 1 - half - first) / step + 1 : 0;
  }
  [[nodiscard]] int size(int layer) const noexcept { return 3 * (2 * step * (layer + 1) + 1); }
  [[nodiscard]] int size_step() const noexcept { return 6 * step; }
  int step, first = 0, columns = 0, rows = 0;
};

Surf::Surf(int max_width, int max_height, Arena& arena)
    : max_width_(std::max(0, max_width)),
      max_height_(std::max(0, max_height)),
      sums_(max_width, max_height, arena),
      rows_(arena.make<float>(static_cast<std::size_t>(max_width_) * kLayers * kRows,
                              "rows of blob responses")) {}

SurfStatus Surf::set_image(const ImageView& image) noexcept {
  sums_.clear();
  if (image.empty() || image.stride < image.width) return SurfStatus::invalid_image;
  if (image.width > max_width_ || image.height > max_height_) return SurfStatus::too_large;
  sums_.build(image);
  return SurfStatus::ok;
}

bool Surf::greatest(int layer, int column, int row) const noexcept {
  const float value = responses(layer, row)[column];
  for (int k = layer - 1; k <= layer + 1; ++k) {
    for (int j = row - 1; j <= row + 1; ++j) {
      const float* r = responses(k, j) + column;
      for (int i = -1; i <= 1; ++i) {
        if (k == layer && j == row && i == 0) continue;
        // Among equal neighbours the first is the maximum, so that a blob between two pixels is
        // found once.
        const bool before = k != layer ? k < layer : j != row ? j < row : i < 0;
        if (before ? !(value > r[i]) : !(value >= r[i])) return false;
      }
    }
  }
  return true;
}

bool Surf::refine(const Octave& octave, int layer, int column, int row,
                  SurfPoint* p) const noexcept {
  const auto at = [&](int k, int j, int i) noexcept {
    return static_cast<double>(responses(layer + k, row + j)[column + i]);
  };
  const double centre = at(0, 0, 0);
  const Vec2 gradient = 0.5 * Vec2(at(0, 0, 1) - at(0, 0, -1), at(0, 1, 0) - at(0, -1, 0));
  Mat2 curvature;
  curvature(0, 0) = at(0, 0, 1) - 2 * centre + at(0, 0, -1);
  curvature(1, 1) = at(0, 1, 0) - 2 * centre + at(0, -1, 0);
  curvature(0, 1) = curvature(1, 0) =
      0.25 * (at(0, 1, 1) - at(0, 1, -1) - at(0, -1, 1) + at(0, -1, -1));
  const Vec2 top = -(curvature.inverse() * gradient);
  const double size_top =
      -0.5 * (at(1, 0, 0) - at(-1, 0, 0)) / (at(1, 0, 0) - 2 * centre + at(-1, 0, 0));
  // The negated comparison also rejects NaN, from zero curvature.
  if (!(top.cwiseAbs().maxCoeff() <= kMaxOffset && std::abs(size_top) <= kMaxOffset)) return false;
  const int x = octave.first + column * octave.step, y = octave.first + row * octave.step,
            size = octave.size(layer);
  p->x = static_cast<float>(x + top.x() * octave.step);
  p->y = static_cast<float>(y + top.y() * octave.step);
  p->scale = kSigmaOfSize * static_cast<float>(size + size_top * octave.size_step());
  p->response = static_cast<float>(centre);
  p->dark = detail::box_hessian(sums_, x, y, size).trace() > 0;
  return true;
}

int Surf::scan_octave(const Octave& octave, const SurfOptions& options,
                      BoundedVector<SurfPoint>* out) noexcept {
  if (octave.columns < kRows) return 0;
  int found = 0;
  for (int row = 0; row < octave.rows; ++row) {
    for (int k = 0; k < kLayers; ++k)
      detail::determinant_row(sums_, octave.first, octave.first + row * octave.step, octave.size(k),
                              octave.step, octave.columns, responses(k, row));
    if (row < 2) continue;
    for (int k = 1; k < kLayers - 1; ++k) {
      const float* r = responses(k, row - 1);
      for (int i = 1; i < octave.columns - 1; ++i) {
        if (!(r[i] > options.min_response) || r[i] < r[i + 1] || r[i] <= r[i - 1]) continue;
        SurfPoint p;
        if (!greatest(k, i, row - 1) || !refine(octave, k, i, row - 1, &p)) continue;
        if (options.mask != nullptr &&
            options.mask->hides({static_cast<double>(p.x), static_cast<double>(p.y)}))
          continue;
        ++found;
        offer(p, out);
      }
    }
  }
  return found;
}

int Surf::detect(const SurfOptions& options, BoundedVector<SurfPoint>* out) noexcept {
  out->clear();
  int found = 0;
  for (int o = 0; o < kOctaves; ++o)
    found += scan_octave(Octave(o, sums_.width(), sums_.height()), options, out);
  std::sort(out->begin(), out->end(), stronger);
  return found;
}

void Surf::describe(std::span<const SurfPoint> points,
                    std::span<SurfDescriptor> out) const noexcept {
  assert(points.size() == out.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    out[i] = detail::surf_descriptor(sums_, points[i]);
}

}  // namespace vergence::features
