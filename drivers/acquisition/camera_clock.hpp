#pragma once
#include <cstdint>

#include "drivers/camera.hpp"
#include "drivers/sync/clock_mapper.hpp"

namespace vergence {

/// A camera's clock on the host's, from its frames.
///
/// From the end of an exposure to the arrival is always as long, from its start not: exposures that
/// grow would look like a clock that drifts. So the clock is fitted to where the frame would have
/// started with the first frame's exposure.
///
/// Threads  One. Memory: that of a ClockMapper. Errors: none.
class CameraClock {
 public:
  explicit CameraClock(const ClockMapperOptions& clock) : clock_(clock) {}

  /// The start of its exposure on the host's clock.
  [[nodiscard]] MappedStamp start_of(const Frame& frame) noexcept {
    if (exposure_ == Duration{}) exposure_ = frame.exposure;
    const Duration longer = frame.exposure - exposure_;
    MappedStamp start = clock_.map(frame.exposure_start + longer, frame.arrival);
    start.host = start.host - longer;
    return start;
  }
  /// It was started again: its clock is another.
  void restart() noexcept { clock_.restart(); }
  /// Times that the clock was found set.
  [[nodiscard]] std::uint64_t resets() const noexcept { return clock_.resets(); }

 private:
  ClockMapper clock_;
  Duration exposure_{};  // of the first frame: what the mapper's least delay holds for
};

}  // namespace vergence
