#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>

namespace vergence {

/// Non-owning view of an 8-bit grey image, with row 0 at the top. Bytes between `width` and
/// `stride` are padding of any value.
///
/// Ownership  The memory outlives the view by contract of its provider (FramePool slot, pyramid
///            level).
/// Threads    Plain reads; any number of readers while no thread writes.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  /// Distance between rows in bytes, ≥ width.
  std::ptrdiff_t stride = 0;

  [[nodiscard]] constexpr bool empty() const noexcept {
    return data == nullptr || width <= 0 || height <= 0;
  }
  [[nodiscard]] const std::uint8_t* row(int y) const noexcept {
    assert(y >= 0 && y < height);
    return data + y * stride;
  }
  [[nodiscard]] std::uint8_t at(int x, int y) const noexcept {
    assert(x >= 0 && x < width);
    return row(y)[x];
  }
};

}  // namespace vergence
