#include "drivers/sync/sync_out_pulses.hpp"

namespace vergence {

std::optional<Pulse> SyncOutPulses::reading(const InsReading& reading, MappedStamp at) noexcept {
  const bool marked = divider_ == 0;
  if (marked && !reading.quality.sync_out) return std::nullopt;
  if (any_ && reading.measured <= last_) {
    ++boot_;
    fresh_ = true;
  }
  const bool begins = fresh_;
  if (begins) {
    first_ = reading.measured;
    base_ = any_ ? number_ + 1 : 0;
    fresh_ = false;
  }
  any_ = true;
  last_ = reading.measured;
  const Duration since = reading.measured - first_;
  const std::int64_t steps = (since + interval_ / 2).ns() / interval_.ns();
  Duration off = since - interval_ * steps;
  if (marked && off < Duration{}) {
    first_ = first_ + off;
    off = {};
  }
  const bool of_pulse = marked || ((off < Duration{} ? -off : off) * 2 * divider_ < interval_);
  const std::uint64_t number = base_ + static_cast<std::uint64_t>(steps);
  if (!of_pulse || (!begins && number <= number_)) return std::nullopt;
  number_ = number;
  Pulse p;
  p.number = number;
  p.edge = reading.measured - off;
  p.arrival = reading.arrival;
  p.boot = boot_;
  p.resumed = begins;
  p.mapped = true;
  p.host = at.host - off;
  p.host_error = at.error;
  return p;
}

}  // namespace vergence
