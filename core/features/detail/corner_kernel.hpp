#pragma once

#include "core/types/image.hpp"

namespace vergence::features::detail {

/// Radius of the structure tensor's 7×7 window, in px.
inline constexpr int kTensorRadius = 3;
/// Maximum side of a block in px: a cell of kMaxCell with its neighbours, in whole vectors of 16.
inline constexpr int kMaxBlock = 136;

/// Corner scores of the block of w×h px whose first pixel is (x0, y0): score[y · kMaxBlock + x]. No
/// score of row y exceeds bound[y].
/// Precondition: w, h ≤ kMaxBlock − 8; the block with kTensorRadius + 1 px around it, and 24 px
/// more to the right, is inside the image or its padding.
void corner_scores(const ImageView& image, int x0, int y0, int w, int h, float* score,
                   float* bound) noexcept;

}  // namespace vergence::features::detail
