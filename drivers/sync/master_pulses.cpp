#include "drivers/sync/master_pulses.hpp"

#include <algorithm>

namespace vergence {

MasterPulses::Report MasterPulses::frame(const SyncFrame& frame) noexcept {
  const auto counted = static_cast<std::int64_t>(frame.counter - counter_);
  Report report;
  Pulse& pulse = report.pulse;
  pulse.edge = frame.exposure_start;
  pulse.arrival = frame.arrival;
  pulse.mapped = true;
  pulse.host = frame.middle.host - frame.exposure / 2;
  pulse.host_error = frame.middle.error;
  if (!known_) {
    pulse.resumed = true;
  } else if (align_) {
    const Duration since = frame.exposure_start - stamp_;
    const std::int64_t steps = (since + interval_ / 2).ns() / interval_.ns();
    pulse.resumed = true;
    base_ +=
        counter_ + static_cast<std::uint64_t>(std::max<std::int64_t>(steps, 1)) - frame.counter;
  } else if (counted <= 0) {
    if (counted == 0 && frame.exposure_start == stamp_) {
      report.again = true;
      return report;
    }
    report.contradicted = true;
    ++boot_;
  } else {
    report.lost = static_cast<std::uint64_t>(counted) - 1;
    pulse.resumed = frame.exposure_start - stamp_ > interval_ * counted + interval_ / 2;
  }
  pulse.number = base_ + frame.counter;
  pulse.boot = boot_;
  known_ = true;
  align_ = false;
  counter_ = frame.counter;
  stamp_ = frame.exposure_start;
  return report;
}

}  // namespace vergence
