#pragma once
#include <cstdint>

#include "core/types/time.hpp"
#include "drivers/device.hpp"

namespace vergence::v4l2 {

/// Instant of a buffer's stamp.
enum class StampKind : std::uint8_t {
  exposure_start,
  frame_end,  // the last pixel was read out
  none,       // the driver gives none on CLOCK_MONOTONIC
};

/// From the buffer's flags and its stamp; a zero stamp is none.
[[nodiscard]] StampKind stamp_kind(std::uint32_t buffer_flags, std::int64_t stamp_ns) noexcept;

/// Start of the exposure on CLOCK_MONOTONIC. `readout`: from the end of the exposure to the last
/// pixel.
[[nodiscard]] DeviceStamp exposure_start(StampKind kind, std::int64_t stamp_ns, HostStamp arrival,
                                         Duration exposure, Duration readout) noexcept;

/// Counts exposures by the 32-bit numbers buffers carry, from 0 on. A driver that does not number
/// its buffers is counted by time.
///
/// Not thread-safe. Memory: none but its own.
class SequenceCounter {
 public:
  /// `period`: between two exposures; zero: unknown, then unnumbered buffers count one each.
  explicit SequenceCounter(Duration period) noexcept : period_(period) {}

  struct Step {
    std::uint64_t counter = 0;
    std::uint64_t missing = 0;  // exposures between the last buffer and this one
  };
  /// Buffers in the order they were dequeued.
  [[nodiscard]] Step next(std::uint32_t sequence, DeviceStamp stamp) noexcept;

 private:
  Duration period_;
  bool any_ = false;
  std::uint32_t last_ = 0;
  DeviceStamp last_stamp_{};
  std::uint64_t counter_ = 0;
};

/// Thins a camera that cannot run slowly enough: of its frames the first one in every interval of
/// CLOCK_MONOTONIC is kept, so that all cameras of a rig keep frames of the same moments, whenever
/// each was started.
class Raster {
 public:
  /// Precondition: interval > 0.
  explicit Raster(Duration interval) noexcept : interval_(interval) {}

  /// False: not the first of its interval. Else step->counter is the interval's number since the
  /// first frame's.
  [[nodiscard]] bool keep(DeviceStamp stamp, SequenceCounter::Step* step) noexcept;

 private:
  Duration interval_;
  bool any_ = false;
  std::int64_t first_ = 0, last_ = 0;  // intervals since the clock's origin
};

}  // namespace vergence::v4l2
