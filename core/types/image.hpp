#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>

namespace vergence {

/// View of an 8-bit grey image, which it does not own, row 0 on top. Bytes between `width` and
/// `stride` are padding of any value.
///
/// Ownership  A view; the memory outlives it by contract of who hands it out (FramePool slot,
///            pyramid level).
/// Threads    Plain reads; any number of readers while no thread writes.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  // bytes from a row to the next, ≥ width

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
