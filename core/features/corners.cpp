#include "core/features/corners.hpp"

#include <algorithm>
#include <array>

#include "core/features/detail/corner_kernel.hpp"

namespace vergence::features {
namespace {

// Margin at the right edge in px, because vector loads exceed the block by up to 16 + 8 pixels.
constexpr int kRightMargin = 28;
// Minimum score in (grey levels / px)². Rounding to whole grey levels causes 1/24, at most 1/4 in a
// cell; below it align() finds a window flat (kMinHessian).
constexpr float kFlat = 0.25F;

struct Grid {
  int cell, columns, rows;
  [[nodiscard]] int cells() const noexcept { return columns * rows; }
  [[nodiscard]] int index(float x, float y) const noexcept {
    const int c = std::clamp(static_cast<int>(x) / cell, 0, columns - 1);
    const int r = std::clamp(static_cast<int>(y) / cell, 0, rows - 1);
    return r * columns + c;
  }
};

/// Best unmasked local maximum of the block's scores without its outer ring; score 0 if there is
/// none. (x0, y0): the block's first pixel in the image.
Corner best_corner(const float* score, const float* bound, int x0, int y0, int w, int h,
                   const Mask* mask) noexcept {
  Corner best;
  const auto scan = [&](int y) {
    const float* s = score + y * detail::kMaxBlock;
    const float* up = s - detail::kMaxBlock;
    const float* down = s + detail::kMaxBlock;
    for (int x = 1; x < w - 1; ++x) {
      const float v = s[x];
      if (v > best.score && v >= s[x - 1] && v >= s[x + 1] && v >= up[x] && v >= down[x] &&
          v >= up[x - 1] && v >= up[x + 1] && v >= down[x - 1] && v >= down[x + 1] &&
          (mask == nullptr || !mask->hides(x0 + x, y0 + y)))
        best = {static_cast<float>(x), static_cast<float>(y), v};
    }
  };
  // After the row with the highest score few others can hold a better corner.
  scan(static_cast<int>(std::max_element(bound + 1, bound + h - 1) - bound));
  for (int y = 1; y < h - 1; ++y)
    if (bound[y] > best.score) scan(y);
  return best;
}

bool stronger(const Corner& a, const Corner& b) noexcept {
  if (a.score != b.score) return a.score > b.score;
  // Make the order unique, independent of the sort.
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

bool crowded(const Corner& c, std::span<const Corner> others, float distance) noexcept {
  return std::any_of(others.begin(), others.end(), [&](const Corner& o) {
    const float dx = c.x - o.x, dy = c.y - o.y;
    return dx * dx + dy * dy < distance * distance;
  });
}

/// Finds the best corner of each free cell in a row of the grid, at found[cell]; score 0 if there
/// is none.
void scan_row(const ImageView& image, const CornerOptions& options, const Grid& grid,
              const bool* occupied, int row, Corner* found) noexcept {
  alignas(64) std::array<float, detail::kMaxBlock * detail::kMaxBlock> score;
  std::array<float, detail::kMaxBlock> bound;
  const int low = std::max(options.border, detail::kTensorRadius + 2);
  for (int c = 0; c < grid.columns; ++c) {
    const int cell = row * grid.columns + c;
    found[cell] = {};
    if (occupied[cell]) continue;
    const int x0 = std::max(c * grid.cell, low) - 1, y0 = std::max(row * grid.cell, low) - 1;
    const int x1 = std::min((c + 1) * grid.cell, image.width - std::max(low, kRightMargin)) + 1;
    const int y1 = std::min((row + 1) * grid.cell, image.height - low) + 1;
    if (x1 - x0 < 4 || y1 - y0 < 4) continue;
    detail::corner_scores(image, x0, y0, x1 - x0, y1 - y0, score.data(), bound.data());
    Corner best = best_corner(score.data(), bound.data(), x0, y0, x1 - x0, y1 - y0, options.mask);
    if (!(best.score > kFlat)) continue;
    best.x += static_cast<float>(x0);
    best.y += static_cast<float>(y0);
    found[cell] = best;
  }
}

}  // namespace

void find_corners(const ImageView& image, const CornerOptions& options,
                  std::span<const Corner> taken, PairRunner& runner,
                  BoundedVector<Corner>* out) noexcept {
  out->clear();
  if (image.empty()) return;
  Grid grid{};
  for (int cell = std::max(options.cell, 8); grid.cell == 0 || grid.cells() > kMaxGridCells; ++cell)
    grid = {cell, (image.width + cell - 1) / cell, (image.height + cell - 1) / cell};
  if (grid.cell > kMaxCell) return;
  std::array<bool, kMaxGridCells> occupied{};
  for (const Corner& c : taken) occupied[static_cast<std::size_t>(grid.index(c.x, c.y))] = true;

  std::array<Corner, kMaxGridCells> found;
  for_each_index(runner, static_cast<std::size_t>(grid.rows), [&](std::size_t row) noexcept {
    scan_row(image, options, grid, occupied.data(), static_cast<int>(row), found.data());
  });

  const auto end = std::remove_if(found.begin(), found.begin() + grid.cells(),
                                  [](const Corner& c) { return !(c.score > 0.F); });
  std::sort(found.begin(), end, stronger);
  for (auto it = found.begin(); it != end && !out->full(); ++it)
    if (!crowded(*it, taken, options.min_distance) &&
        !crowded(*it, out->span(), options.min_distance))
      (void)out->push(*it);
}

}  // namespace vergence::features
