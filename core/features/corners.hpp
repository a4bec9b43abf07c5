#pragma once
#include <span>

#include "core/features/mask.hpp"
#include "core/memory/fixed_vector.hpp"
#include "core/types/image.hpp"
#include "core/types/parallel.hpp"

namespace vergence::features {

/// A corner that can be followed.
struct Corner {
  float x = 0, y = 0;
  /// Smaller eigenvalue of the mean structure tensor over 7×7 px, in (grey levels / px)² (Shi &
  /// Tomasi 1994).
  float score = 0;
};

struct CornerOptions {
  /// Minimum cell size in px; there is at most one corner per cell. Cells are larger if there would
  /// be more than kMaxGridCells.
  int cell = 32;
  /// Margin of the image without corners, in px.
  int border = 16;
  /// Minimum distance to an existing corner, in px.
  float min_distance = 12;
  /// Mask of the image; may be null.
  const Mask* mask = nullptr;
};

/// Maximum cell size in px, which determines the working memory.
inline constexpr int kMaxCell = 128;
/// Maximum number of cells of an image.
inline constexpr int kMaxGridCells = 4096;

/// Finds the strongest corner of every grid cell without any of `taken`, strongest first, as many
/// as `out` can hold. The ranking needs no absolute contrast, which a scene may not offer; only
/// corners that cannot be aligned are left out.
///
/// Threads  The runner takes part of the grid's rows; the result does not depend
///          on it.
/// Memory   On the stack, bounded by kMaxCell and kMaxGridCells. If `out` is full, the weakest
///          corners are dropped.
void find_corners(const ImageView& image, const CornerOptions& options,
                  std::span<const Corner> taken, PairRunner& runner,
                  BoundedVector<Corner>* out) noexcept;

}  // namespace vergence::features
