#include "drivers/v4l2/stamps.hpp"

#include <linux/videodev2.h>

#include <algorithm>

namespace vergence::v4l2 {

StampKind stamp_kind(std::uint32_t flags, std::int64_t stamp_ns) noexcept {
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC || stamp_ns <= 0)
    return StampKind::none;
  return (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE
             ? StampKind::exposure_start
             : StampKind::frame_end;
}

DeviceStamp exposure_start(StampKind kind, std::int64_t stamp_ns, HostStamp arrival,
                           Duration exposure, Duration readout) noexcept {
  switch (kind) {
    case StampKind::exposure_start:
      return DeviceStamp(stamp_ns);
    case StampKind::frame_end:
      return DeviceStamp(stamp_ns) - readout - exposure;
    case StampKind::none:
      break;
  }
  return DeviceStamp(arrival.ns()) - readout - exposure;
}

SequenceCounter::Step SequenceCounter::next(std::uint32_t sequence, DeviceStamp stamp) noexcept {
  std::uint64_t steps = 0;
  if (any_) {
    // The signed difference is correct across the wrap.
    const auto ahead = static_cast<std::int32_t>(sequence - last_);
    steps = static_cast<std::uint64_t>(std::max(ahead, 1));
    if (ahead == 0 && period_ > Duration{}) {
      const std::int64_t periods = ((stamp - last_stamp_).ns() + period_.ns() / 2) / period_.ns();
      steps = static_cast<std::uint64_t>(std::max<std::int64_t>(periods, 1));
    }
  }
  any_ = true;
  last_ = sequence;
  last_stamp_ = stamp;
  counter_ += steps;
  return {counter_, steps > 1 ? steps - 1 : 0};
}

bool Raster::keep(DeviceStamp stamp, SequenceCounter::Step* step) noexcept {
  const std::int64_t interval = stamp.ns() / interval_.ns();
  if (any_ && interval <= last_) return false;
  const std::int64_t missing = any_ ? interval - last_ - 1 : 0;
  if (!any_) first_ = interval;
  any_ = true;
  last_ = interval;
  *step = {static_cast<std::uint64_t>(interval - first_), static_cast<std::uint64_t>(missing)};
  return true;
}

}  // namespace vergence::v4l2
