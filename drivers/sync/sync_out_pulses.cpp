#include "drivers/sync/sync_out_pulses.hpp"

#include <algorithm>

namespace vergence {

bool SyncOutPulses::pulsed(const InsReading& reading) noexcept {
  if (divider_ == 0) return reading.quality.sync_out;
  if (fresh_) first_ = reading.measured;
  const Duration sample = interval_ / divider_;
  const std::int64_t count = (reading.measured - first_ + sample / 2).ns() / sample.ns();
  return count % divider_ == 0;
}

std::optional<Pulse> SyncOutPulses::reading(const InsReading& reading, MappedStamp at) noexcept {
  const Duration passed = reading.measured - last_;
  if (any_ && passed <= Duration{}) {
    ++boot_;
    fresh_ = true;
  }
  if (!pulsed(reading)) return std::nullopt;
  Pulse p;
  p.resumed = fresh_;
  const std::int64_t steps = any_ && !fresh_ ? (passed + interval_ / 2).ns() / interval_.ns() : 1;
  number_ += any_ ? static_cast<std::uint64_t>(std::max<std::int64_t>(steps, 1)) : 0;
  any_ = true;
  fresh_ = false;
  last_ = reading.measured;
  p.number = number_;
  p.edge = reading.measured;
  p.arrival = reading.arrival;
  p.boot = boot_;
  p.mapped = true;
  p.host = at.host;
  p.host_error = at.error;
  return p;
}

}  // namespace vergence
