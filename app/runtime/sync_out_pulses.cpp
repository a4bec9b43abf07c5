#include "app/runtime/sync_out_pulses.hpp"

#include <cstdlib>

namespace vergence::app {

std::optional<Pulse> SyncOutPulses::take(const InsReading& reading, const MappedStamp& measured) noexcept {
  if (marked_ && !reading.quality.sync_out) return std::nullopt;
  const bool begins = !any_;
  if (begins) {
    any_ = true;
    first_ = reading.measured;
    newest_ = 0;
  }
  const Duration since = reading.measured - first_;
  if (since < Duration{}) return std::nullopt;
  const std::int64_t number = (since + interval_ / 2).ns() / interval_.ns();
  Duration off = since - interval_ * number;
  if (marked_ && off < Duration{}) {  // the mark is on the sample after the pulse: the earliest is the nearest
    first_ = first_ + off;
    off = {};
  }
  // Without marks only the samples that a pulse falls on are pulses: within a tenth of the interval, samples are at least three to it.
  if (!marked_ && std::abs(off.ns()) * 10 > interval_.ns()) return std::nullopt;
  if (!begins && static_cast<std::uint64_t>(number) <= newest_) return std::nullopt;
  Pulse p;
  p.number = newest_ = static_cast<std::uint64_t>(number);
  p.edge = first_ + interval_ * number;
  p.arrival = reading.arrival;
  p.boot = boot_;
  p.resumed = begins;
  p.mapped = true;
  p.host = measured.host - off;
  p.host_error = measured.error;
  ++pulses_;
  return p;
}

}  // namespace vergence::app
