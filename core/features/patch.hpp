#pragma once
#include <array>
#include <cstdint>

#include "core/features/pyramid.hpp"
#include "core/math/types.hpp"

namespace vergence::features {

inline constexpr int kPatchLevels = 4;  // pyramid levels a patch is kept at
inline constexpr int kPatchSide =
    28;  // px kept a side: the window turned by 45° or seen 1.5 times smaller still lies inside
inline constexpr int kPatchBytes =
    kPatchSide * kPatchSide + 16;         // room for vector loads behind the last pixel
inline constexpr int kWindow = 12;        // px aligned a side
inline constexpr int kWindowStride = 16;  // floats a row of the window in memory

/// Appearance of a point where it was first seen: the pixels around it at several levels. Its
/// anchor is the pixel (x, y) of level 0 it was cut at; at level l the patch's middle pixel is the
/// anchor's nearest, and `offset` is the anchor's place in that pixel, so that no level moves
/// it.
struct Patch {
  std::array<std::array<std::uint8_t, kPatchBytes>, kPatchLevels> pixels;
  std::array<Eigen::Vector2f, kPatchLevels> offset;  // px of the level, |·| ≤ 0.5
  std::uint8_t levels = 0;                           // how many levels lay inside the image
};

/// Cuts a patch at a pixel of level 0. False: level 0 does not lie inside the image, *patch is not
/// usable.
[[nodiscard]] bool cut_patch(const Pyramid& pyramid, const Vec2& at, Patch* patch) noexcept;

enum class AlignStatus : std::uint8_t {
  ok,
  outside,       // the window left the image
  flat,          // no structure to hold it in both directions
  diverged,      // moved further than kMaxAlignStep allows, or did not settle
  uncorrelated,  // settled on something that looks different
};

struct AlignResult {
  AlignStatus status = AlignStatus::outside;
  Vec2 pixel{};    // level 0
  float zncc = 0;  // normalised correlation of window and image at the end, level of the last step
  float sigma =
      0;  // px, level 0: predicted from the window's gradients for one grey level of noise
  int steps = 0;
};

struct AlignOptions {
  int coarsest = 2;        // level to start at
  int finest = 0;          // level to end at
  float min_zncc = 0.8F;   // at the end
  float max_shift = 20.F;  // px of level 0, from the prediction
  int max_steps = 12;      // a level
};

/// Finds the patch in an image, starting at a predicted pixel and shape: inverse-compositional
/// alignment of the window (Baker & Matthews 2004) over translation, with gain and offset of the
/// grey values eliminated in closed form.
///
/// A = ∂(pixel in this image)/∂(pixel where the patch was cut), at the patch's middle. The
/// projection to the orthogonal complement of {1, T} makes the steps independent of brightness and
/// contrast.
[[nodiscard]] AlignResult align(const Patch& patch, const Pyramid& image, const Vec2& predicted,
                                const Mat2& A, const AlignOptions& options) noexcept;

}  // namespace vergence::features
