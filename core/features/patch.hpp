#pragma once
#include <array>
#include <cstdint>

#include "core/features/pyramid.hpp"
#include "core/math/types.hpp"

namespace vergence::features {

/// Number of pyramid levels of a patch.
inline constexpr int kPatchLevels = 4;
/// Side of a patch in px, so that the window rotated by 45° or scaled by 1.5 is inside.
inline constexpr int kPatchSide = 28;
/// Bytes of a level, with room for vector loads after the last pixel.
inline constexpr int kPatchBytes = kPatchSide * kPatchSide + 16;
/// Side of the aligned window, in px.
inline constexpr int kWindow = 12;
/// Number of floats per row of the window in memory.
inline constexpr int kWindowStride = 16;

/// Appearance of a point where it was first seen: the pixels around it on several levels. Its
/// anchor is the pixel (x, y) of level 0 at which it was cut. On level l the middle pixel is the
/// one nearest to the anchor, and `offset` is the anchor's position in it.
struct Patch {
  std::array<std::array<std::uint8_t, kPatchBytes>, kPatchLevels> pixels;
  /// In px of the level, |·| ≤ 0.5.
  std::array<Eigen::Vector2f, kPatchLevels> offset;
  /// Number of levels that were inside the image.
  std::uint8_t levels = 0;
};

/// Cuts a patch at a pixel of level 0. Returns false if level 0 is not inside the image; *patch is
/// then not usable.
[[nodiscard]] bool cut_patch(const Pyramid& pyramid, const Vec2& at, Patch* patch) noexcept;

enum class AlignStatus : std::uint8_t {
  ok,
  /// The window left the image.
  outside,
  /// The window lacks structure in a direction.
  flat,
  /// It moved further than AlignOptions::max_shift, or did not settle.
  diverged,
  /// It settled on something that looks different.
  uncorrelated,
};

struct AlignResult {
  AlignStatus status = AlignStatus::outside;
  Vec2 pixel{};
  /// Final normalised correlation of window and image, on the level of the last step.
  float zncc = 0;
  /// Standard deviation on level 0 in px, predicted from the window's gradients for one grey level
  /// of noise.
  float sigma = 0;
};

/// Minimum correlation of two windows to be compared further; the epipolar distance, the ratio to
/// the second best and later frames decide on the match. The value was the best over thirteen
/// sequences.
inline constexpr float kMinZncc = 0.7F;

struct AlignOptions {
  /// First level.
  int coarsest = 2;
  /// Last level.
  int finest = 0;
  float min_zncc = kMinZncc;
  /// Maximum distance from the prediction, in px of level 0.
  float max_shift = 20.F;
};

/// Finds the patch in an image, starting at a predicted pixel and shape: inverse-compositional
/// alignment of the window (Baker & Matthews 2004) over translation, with gain and offset of the
/// grey values eliminated in closed form.
///
/// A = ∂(pixel in this image)/∂(pixel where the patch was cut), at the middle of the patch. The
/// projection to the orthogonal complement of {1, T} makes the steps independent of brightness and
/// contrast.
[[nodiscard]] AlignResult align(const Patch& patch, const Pyramid& image, const Vec2& predicted,
                                const Mat2& A, const AlignOptions& options) noexcept;

}  // namespace vergence::features
