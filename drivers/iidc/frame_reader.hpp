#pragma once
#include <cstdint>
#include <mutex>

#include "drivers/camera.hpp"
#include "drivers/iidc/camera_plan.hpp"
#include "firmware_iface/iidc/iidc.hpp"

namespace vergence::iidc {

/// Result of reading one arrival.
struct ReadFrame {
  /// False if no exposure could be identified; its number, if any, appears as a gap.
  bool accepted = false;
  /// True if not accepted although long enough for a frame, which suggests a misaligned stream.
  bool stray = false;
  FrameStatus status = FrameStatus::complete;
  std::uint64_t counter = 0;
  /// Exposures missing between the last accepted frame and this one.
  std::uint64_t missing = 0;
  DeviceStamp exposure_start{};
};

/// Unwraps the clock of the cameras' stamps, which wraps after 128 s. All cameras of an IEEE 1394
/// bus share one, so that their counts of wraps agree. Thread-safe.
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

/// Extracts number, stamp and completeness from the stream's buffers.
///
/// With embedded information, counter and stamp are the camera's. A number that disagrees with the
/// time since the last frame is ignored unless the next one continues it. Without it, frames are
/// counted on arrival and gaps derived from bus stamps if available. If an isochronous packet is
/// lost, the next frame's beginning fills the buffer; its stamp is then found at a packet boundary
/// inside the image.
/// Only the stream's thread may call it after begin(). Does not allocate.
class FrameReader {
 public:
  void begin(const CameraPlan& plan, bool isochronous, SharedClock* clock) noexcept;
  [[nodiscard]] ReadFrame read(const Arrival& arrival) noexcept;
  /// Sets the exposure of the next frame, which is needed to refer its stamp to the start of
  /// exposure.
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
  // True after an implausible number.
  bool suspect_ = false;
  std::uint32_t suspect_counter_ = 0;
};

}  // namespace vergence::iidc
