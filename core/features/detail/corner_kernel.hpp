#pragma once
#include <cstddef>

#include "core/types/image.hpp"

namespace vergence::features::detail {

inline constexpr int kTensorRadius = 3;  // px: the 7×7 window of the structure tensor
inline constexpr int kMaxBlock =
    136;  // px a side: a cell of kMaxCell with a ring of neighbours, in whole vectors of 16

/// Corner score of the block of w×h px whose first pixel is (x0, y0): score[y · kMaxBlock + x].
/// Precondition: w, h ≤ kMaxBlock − 8; the block with kTensorRadius + 1 px around, and 24 px more
/// to the right, lies inside the image or its padding.
void corner_scores(const ImageView& image, int x0, int y0, int w, int h, float* score) noexcept;

}  // namespace vergence::features::detail
