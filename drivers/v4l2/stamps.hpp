#pragma once
#include <cstdint>

#include "core/types/time.hpp"
#include "drivers/device.hpp"

namespace vergence::v4l2 {

/// Instant that a buffer's stamp refers to.
enum class StampKind : std::uint8_t {
  exposure_start,
  /// End of the readout of the last pixel.
  frame_end,
  /// The driver gives no stamp on CLOCK_MONOTONIC.
  none,
};

/// Kind of a stamp from the buffer's flags; a zero stamp is none.
[[nodiscard]] StampKind stamp_kind(std::uint32_t buffer_flags, std::int64_t stamp_ns) noexcept;

/// Start of the exposure on CLOCK_MONOTONIC. `readout` is the time from the end of the exposure to
/// the last pixel.
[[nodiscard]] DeviceStamp exposure_start(StampKind kind, std::int64_t stamp_ns, HostStamp arrival,
                                         Duration exposure, Duration readout) noexcept;

/// Counts exposures from 0 by the buffers' 32-bit numbers. Buffers without numbers are counted by
/// time. Not thread-safe.
class SequenceCounter {
 public:
  /// `period` is the interval of exposures. If it is zero (unknown), unnumbered buffers count one
  /// each.
  explicit SequenceCounter(Duration period) noexcept : period_(period) {}

  struct Step {
    std::uint64_t counter = 0;
    /// Exposures missing between the last buffer and this one.
    std::uint64_t missing = 0;
  };
  /// Call in the order in which buffers were dequeued.
  [[nodiscard]] Step next(std::uint32_t sequence, DeviceStamp stamp) noexcept;

 private:
  Duration period_;
  bool any_ = false;
  std::uint32_t last_ = 0;
  DeviceStamp last_stamp_{};
  std::uint64_t counter_ = 0;
};

/// Thins the frames of a camera that cannot run slowly enough: keeps the first frame in every
/// interval of CLOCK_MONOTONIC. All cameras of a rig thus keep frames of the same moments,
/// regardless of when each was started.
class Raster {
 public:
  /// Precondition: interval > 0.
  explicit Raster(Duration interval) noexcept : interval_(interval) {}

  /// Returns true for the first frame of its interval; step->counter is then the interval's number
  /// since the first frame's.
  [[nodiscard]] bool keep(DeviceStamp stamp, SequenceCounter::Step* step) noexcept;

 private:
  Duration interval_;
  bool any_ = false;
  // Numbers of intervals since the clock's origin.
  std::int64_t first_ = 0, last_ = 0;
};

}  // namespace vergence::v4l2
