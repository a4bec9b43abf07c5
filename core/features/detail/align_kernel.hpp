#pragma once
#include <cstdint>

#include "core/features/patch.hpp"

namespace vergence::features::detail {

/// Window of a patch, warped to its shape in the image, with the terms that alignment needs.
struct alignas(64) Window {
  /// T − mean T; columns from kWindow on are 0.
  float value[kWindow * kWindowStride];
  /// ∂T/∂x and ∂T/∂y, orthogonal to 1 and T.
  float steep_x[kWindow * kWindowStride];
  float steep_y[kWindow * kWindowStride];
  /// Σ (T − mean)².
  float variance_sum;
  /// Σ of products of steep_x and steep_y.
  float hxx, hxy, hyy;
};

/// Sums over one window of the image at a sub-pixel position.
struct WindowSums {
  /// Σ steep · I.
  float steep_x, steep_y;
  /// Σ (T − mean T) · I.
  float value;
  /// Σ I and Σ I² over the window.
  float sum, square;
};

/// Makes a window. `centre`: position of the anchor in the patch, in px from its first pixel. B =
/// ∂(patch px)/∂(image px).
void make_window(const std::uint8_t* patch, float centre_x, float centre_y, const float B[4],
                 Window* window) noexcept;

/// Sums over the window at a sub-pixel position. Precondition: the kWindow + 1 pixels from (x0, y0)
/// on are inside the image, x0 + kWindowStride may exceed the row by no more than its padding. fx,
/// fy in [0, 1).
void window_sums(const Window& window, const std::uint8_t* at, std::ptrdiff_t stride, float fx,
                 float fy, WindowSums* sums) noexcept;

}  // namespace vergence::features::detail
