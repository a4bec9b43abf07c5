#include "drivers/sync/sync_out_pulses.hpp"

namespace vergence {
namespace {

/// Interval that the INS applies, n / 400 Hz. A requested rate is decimal (26.6667), and edges
/// computed from it would drift by milliseconds per hour.
Duration as_marked(Duration asked) noexcept {
  constexpr Duration kStep = Duration::nanoseconds(2'500'000);
  // Accepted deviation is one part in this number.
  constexpr std::int64_t kAccepted = 1000;
  const Duration made = kStep * ((asked + kStep / 2).ns() / kStep.ns());
  const Duration off = made < asked ? asked - made : made - asked;
  return off * kAccepted <= asked ? made : asked;
}

}  // namespace

SyncOutPulses::SyncOutPulses(Duration interval) noexcept : interval_(as_marked(interval)) {}

std::optional<Pulse> SyncOutPulses::reading(const InsReading& reading, MappedStamp at) noexcept {
  if (!reading.quality.sync_out) return std::nullopt;
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
  if (off < Duration{}) {
    first_ = first_ + off;
    off = {};
  }
  const std::uint64_t number = base_ + static_cast<std::uint64_t>(steps);
  if (!begins && number <= number_) return std::nullopt;
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
