#pragma once
#include "core/math/types.hpp"
#include "core/types/image.hpp"

namespace vergence::features {

/// Shift in px from `before` to `now`, two small images of one size, at which they differ least:
/// the mean squared difference of the overlapping pixels, without that of the means. At most a
/// third of each side, to whole pixels, or to steps of a hundredth of the longer side, so that the
/// time is bounded; zero for empty images. Pure. A turning camera moves its image as a whole
/// (Klein, Murray, Improving the Agility of Keyframe-Based SLAM, ECCV 2008).
[[nodiscard]] Vec2 image_shift(const ImageView& before, const ImageView& now) noexcept;

}  // namespace vergence::features
