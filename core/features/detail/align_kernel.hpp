#pragma once
#include <cstdint>

#include "core/features/patch.hpp"

namespace vergence::features::detail {

/// The window of a patch brought to the shape it has in the image, and what alignment needs of it.
struct alignas(64) Window {
  float value[kWindow * kWindowStride];    // T − mean T; columns from kWindow on are 0
  float steep_x[kWindow * kWindowStride];  // ∂T/∂x, orthogonal to 1 and T
  float steep_y[kWindow * kWindowStride];
  float variance_sum;   // Σ (T − mean)²
  float hxx, hxy, hyy;  // Σ of products of steep_x, steep_y
};

/// Sums over one window of the image at a sub-pixel position.
struct WindowSums {
  float steep_x, steep_y;  // Σ steep · I
  float value;             // Σ (T − mean T) · I
  float sum, square;       // Σ I, Σ I² over the window
};

/// `centre`: where the anchor lies in the patch (px from its first pixel); B = ∂(patch px)/∂(image
/// px).
void make_window(const std::uint8_t* patch, float centre_x, float centre_y, const float B[4],
                 Window* window) noexcept;

/// Precondition: the kWindow + 1 pixels from (x0, y0) on lie inside the image, x0 + kWindowStride
/// may reach past the row's end by no more than its padding. fx, fy in [0, 1).
void window_sums(const Window& window, const std::uint8_t* at, std::ptrdiff_t stride, float fx,
                 float fy, WindowSums* sums) noexcept;

}  // namespace vergence::features::detail
