#pragma once
#include <cstdint>
#include <mutex>

#include "drivers/camera.hpp"
#include "drivers/iidc/camera_plan.hpp"
#include "firmware_iface/iidc/iidc.hpp"

namespace vergence::iidc {

/// Kind of one arrival.
struct ReadFrame {
  bool taken = false;  // false: nothing an exposure could be told from; its number, if it had one,
                       // shows as a gap
  bool stray = false;  // not taken, and long enough to be a frame: the stream may be out of step
  FrameStatus status = FrameStatus::complete;
  std::uint64_t counter = 0;
  std::uint64_t missing = 0;  // exposures between this one and the last taken
  DeviceStamp exposure_start{};
};

/// The clock that cameras stamp by, which wraps after 128 s: all cameras of an IEEE 1394 bus share
/// one, so that their counts of wraps agree.
///
/// Threads  Any, for nanoseconds each.
class SharedClock {
 public:
  [[nodiscard]] std::int64_t unwrap(std::int64_t wrapped_ns, HostStamp at) noexcept {
    const std::lock_guard lock(mutex_);
    return unwrapper_.unwrap(wrapped_ns, at.ns());
  }

 private:
  std::mutex mutex_;
  CycleUnwrapper unwrapper_;
};

/// Reads number, stamp and wholeness out of what the stream brings.
///
/// With embedded information: counter and stamp are the camera's; a number that the time since the
/// last frame cannot explain is not believed, unless the next one continues it. Without: frames are
/// counted as they come, gaps told from bus stamps if there are any. A packet lost on an
/// isochronous bus leaves the buffer to be filled by the beginning of the next frame: the stamp of
/// that one stands at a packet's place inside the image, and is looked for.
/// Threads  One (the stream's), after begin(). Memory: in place. Time: one look per packet.
class FrameReader {
 public:
  void begin(const CameraPlan& plan, bool isochronous, SharedClock* clock) noexcept;
  [[nodiscard]] ReadFrame read(const Arrival& arrival) noexcept;
  /// Sets the exposure of the next frame: stamps of other instants are brought to its start.
  void set_exposure(Duration exposure) noexcept { exposure_ = exposure; }

 private:
  struct Embedded {
    bool valid = false;
    std::uint32_t counter = 0;
    std::int64_t wrapped_ns = 0;
  };
  [[nodiscard]] Embedded embedded(const std::uint8_t* data, std::size_t bytes) const noexcept;
  [[nodiscard]] bool continues(const Embedded& next, HostStamp at) const noexcept;
  [[nodiscard]] bool holds_next_frame(const Arrival& arrival, const Embedded& own) const noexcept;
  [[nodiscard]] ReadFrame count_only(const Arrival& arrival) noexcept;
  [[nodiscard]] Duration to_start() const noexcept;

  StreamShape shape_{};
  FrameInfoLayout info_{};
  StampedInstant stamped_ = StampedInstant::end;
  Duration exposure_{};
  double rate_hz_ = 0;
  bool free_running_ = false;
  bool isochronous_ = false;
  SharedClock* clock_ = nullptr;

  CounterUnwrapper counter_{};
  bool any_ = false;
  HostStamp last_at_{};
  HostStamp last_bus_stamp_{};
  bool suspect_ = false;  // a number that could not be
  std::uint32_t suspect_counter_ = 0;
};

}  // namespace vergence::iidc
