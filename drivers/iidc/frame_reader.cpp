#include "drivers/iidc/frame_reader.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace vergence::iidc {
namespace {

// In Hz; no camera of this kind exposes more often.
constexpr double kHighestRate = 250;
// Maximum number of exposures that arrive together after a delay.
constexpr std::int64_t kBacklog = 64;

}  // namespace

void FrameReader::begin(const CameraPlan& plan, bool isochronous, SharedClock* clock) noexcept {
  *this = FrameReader{};
  shape_ = plan.shape;
  info_ = plan.info;
  stamped_ = plan.options.stamped;
  exposure_ = plan.exposure;
  rate_hz_ = plan.rate_hz;
  free_running_ = plan.trigger == CameraTrigger::free;
  isochronous_ = isochronous;
  clock_ = clock;
}

FrameReader::Embedded FrameReader::embedded(const std::uint8_t* data,
                                            std::size_t bytes) const noexcept {
  Embedded e;
  if (bytes < info_.size()) return e;
  const std::span image(data, bytes);
  e.counter = info_.read(FrameInfoItem::counter, image);
  e.valid = true;
  if (info_.has(FrameInfoItem::time)) {
    const CycleTime t = CycleTime::of(info_.read(FrameInfoItem::time, image));
    e.valid = t.valid();
    e.wrapped_ns = t.ns();
  }
  return e;
}

bool FrameReader::continues(const Embedded& next, HostStamp at) const noexcept {
  if (!counter_.known()) return true;
  const std::int64_t step = counter_.step(next.counter);
  const double elapsed = std::max(0.0, (at - last_at_).to_seconds());
  return step > 0 && step <= kBacklog + static_cast<std::int64_t>(elapsed * kHighestRate);
}

bool FrameReader::holds_next_frame(const Arrival& arrival, const Embedded& own) const noexcept {
  // Maximum difference of the next frame's counter.
  constexpr std::uint32_t kLater = 1000;
  const std::size_t packet = shape_.packet_bytes;
  if (!isochronous_ || packet == 0 || !info_.has(FrameInfoItem::time)) return false;
  for (std::size_t at = packet; at + info_.size() <= arrival.bytes; at += packet) {
    const Embedded e = embedded(arrival.data + at, arrival.bytes - at);
    const std::int64_t later =
        (e.wrapped_ns - own.wrapped_ns + kCycleTimeWrapNs) % kCycleTimeWrapNs;
    // Requires two matching quadlets, which pixels produce by chance once in 10¹⁰ packets.
    if (e.valid && e.counter - own.counter - 1 < kLater && later > 0 &&
        later < kCycleTimeWrapNs / 4)
      return true;
  }
  return false;
}

Duration FrameReader::to_start() const noexcept {
  switch (stamped_) {
    case StampedInstant::start:
      return {};
    case StampedInstant::middle:
      return exposure_ / 2;
    case StampedInstant::end:
      return exposure_;
  }
  return {};
}

ReadFrame FrameReader::read(const Arrival& arrival) noexcept {
  if (arrival.bytes == 0) return {};
  if (!info_.has(FrameInfoItem::counter)) return count_only(arrival);
  ReadFrame f;
  const Embedded e = embedded(arrival.data, arrival.bytes);
  f.stray = arrival.bytes >= shape_.image_bytes;
  if (!e.valid) return f;
  if (!continues(e, arrival.at)) {
    const bool follows = suspect_ && e.counter == suspect_counter_ + 1;
    suspect_ = true;
    suspect_counter_ = e.counter;
    if (!follows) return f;
    // The camera has restarted its counter.
    f.counter = counter_.rebase(e.counter);
  } else {
    f.missing = counter_.known() ? static_cast<std::uint64_t>(counter_.step(e.counter) - 1) : 0;
    f.counter = counter_.unwrap(e.counter);
  }
  suspect_ = false;
  f.accepted = true;
  f.stray = false;
  f.status = arrival.broken || arrival.bytes < shape_.image_bytes || holds_next_frame(arrival, e)
                 ? FrameStatus::incomplete
                 : FrameStatus::complete;
  if (info_.has(FrameInfoItem::time)) {
    f.exposure_start = DeviceStamp(clock_->unwrap(e.wrapped_ns, arrival.at)) - to_start();
  } else {
    f.exposure_start =
        DeviceStamp((arrival.has_bus_stamp ? arrival.bus_stamp : arrival.at).ns()) - exposure_;
  }
  any_ = true;
  last_at_ = arrival.at;
  return f;
}

ReadFrame FrameReader::count_only(const Arrival& arrival) noexcept {
  ReadFrame f;
  f.accepted = true;
  f.status = arrival.broken || arrival.bytes < shape_.image_bytes ? FrameStatus::incomplete
                                                                  : FrameStatus::complete;
  const HostStamp stamp = arrival.has_bus_stamp ? arrival.bus_stamp : arrival.at;
  if (any_ && arrival.has_bus_stamp && free_running_ && rate_hz_ > 0) {
    const double periods = (stamp - last_bus_stamp_).to_seconds() * rate_hz_;
    if (periods > 1.5 && periods < 1e6)
      f.missing = static_cast<std::uint64_t>(std::llround(periods)) - 1;
  }
  const auto step = static_cast<std::uint32_t>(f.missing + 1);
  f.counter = counter_.unwrap(any_ ? counter_.last() + step : 0);
  f.exposure_start = DeviceStamp(stamp.ns()) - exposure_;
  any_ = true;
  last_at_ = arrival.at;
  last_bus_stamp_ = stamp;
  return f;
}

}  // namespace vergence::iidc
