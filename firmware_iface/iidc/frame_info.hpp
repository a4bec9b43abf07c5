#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_iface/iidc/cycle_time.hpp"

/// Data that Point Grey's cameras embed in the first pixels of an image (register FRAME_INFO,
/// 0x12F8).
namespace vergence::iidc {

/// Items in the order of the image; the number is the bit that enables them.
enum class FrameInfoItem : std::uint8_t {
  /// CycleTime at the end of the exposure.
  time = 0,
  gain = 1,
  shutter = 2,
  brightness = 3,
  exposure = 4,
  white_balance = 5,
  /// Number of exposures, including those not sent.
  counter = 6,
  strobe_pattern = 7,
  pins = 8,
  region = 9,
};
inline constexpr unsigned kFrameInfoItems = 10;
inline constexpr std::uint32_t kFrameInfoPresent = 0x8000'0000;
[[nodiscard]] constexpr std::uint32_t frame_info_bit(FrameInfoItem i) noexcept {
  return std::uint32_t{1} << static_cast<unsigned>(i);
}

/// Positions of the items, from the register's value after it was written (bits that a camera lacks
/// stay 0).
class FrameInfoLayout {
 public:
  FrameInfoLayout() noexcept { at_.fill(-1); }
  [[nodiscard]] static FrameInfoLayout of(std::uint32_t quadlet) noexcept;

  [[nodiscard]] bool has(FrameInfoItem i) const noexcept {
    return at_[static_cast<std::size_t>(i)] >= 0;
  }
  /// Bytes at the beginning of the image that are not pixels.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Quadlet of the item. Precondition: has(i), image.size() ≥ size().
  [[nodiscard]] std::uint32_t read(FrameInfoItem i,
                                   std::span<const std::uint8_t> image) const noexcept;

 private:
  std::array<std::int16_t, kFrameInfoItems> at_{};
  std::size_t size_ = 0;
};

/// Unwraps a 32-bit counter so that the first value is 0.
class CounterUnwrapper {
 public:
  /// Signed distance of `counter` from the last one unwrapped; 0 before the first.
  [[nodiscard]] std::int64_t step(std::uint32_t counter) const noexcept {
    return known_ ? static_cast<std::int32_t>(counter - last_) : 0;
  }
  /// Returns the count of a counter. Precondition: step(counter) > 0, or not known.
  [[nodiscard]] std::uint64_t unwrap(std::uint32_t counter) noexcept {
    if (known_) count_ += static_cast<std::uint64_t>(step(counter));
    known_ = true;
    last_ = counter;
    return count_;
  }
  /// Continues after a restart of the device: `counter` is the next exposure after the last one
  /// unwrapped.
  [[nodiscard]] std::uint64_t rebase(std::uint32_t counter) noexcept {
    if (known_) ++count_;
    known_ = true;
    last_ = counter;
    return count_;
  }
  [[nodiscard]] bool known() const noexcept { return known_; }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint32_t last() const noexcept { return last_; }

 private:
  bool known_ = false;
  std::uint32_t last_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace vergence::iidc
