#pragma once
#include <span>

#include "core/features/mask.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/image.hpp"
#include "core/types/parallel.hpp"

namespace vergence::features {

/// A pixel worth following.
struct Corner {
  float x = 0, y = 0;  // px of the image searched
  float score = 0;  // least eigenvalue of the structure tensor's mean over 7×7 px, (grey levels /
                    // px)² (Shi & Tomasi 1994)
};

struct CornerOptions {
  int cell = 32;               // px: at most one corner a cell
  int border = 16;             // px kept free at the image's edge
  float min_distance = 12;     // px to a corner already taken
  const Mask* mask = nullptr;  // of the image searched; null: all of it is looked at
};

inline constexpr int kMaxCell = 128;        // px: sizes the working memory of a cell
inline constexpr int kMaxGridCells = 4096;  // of an image

/// The strongest corner of every grid cell that holds none of `taken`, strongest first, as many as
/// `out` has room for. A corner counts by its rank: what there is no contrast for in absolute
/// numbers may be all that a scene offers. Left out is only what no patch could be aligned on.
///
/// Threads  The runner takes the lower half of the grid to its other side; the result does not
///          depend on it.
/// Memory   On the stacks, bounded by kMaxCell and kMaxGridCells. Corners that find no room are
///          dropped, weakest first.
void find_corners(const ImageView& image, const CornerOptions& options,
                  std::span<const Corner> taken, PairRunner& runner,
                  BoundedVector<Corner>* out) noexcept;

}  // namespace vergence::features
