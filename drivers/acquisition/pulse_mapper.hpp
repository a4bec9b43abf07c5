#pragma once
#include <cstdint>

#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Reports of pulses on the host's clock: what the driver has not mapped is mapped here, with a new
/// fit for every boot.
///
/// Threads  One. Memory: that of a ClockMapper. Errors: none; a reboot is told.
class PulseMapper {
 public:
  struct Report {
    Pulse pulse{};          // mapped
    bool rebooted = false;  // of another boot than the one before it
  };

  explicit PulseMapper(const ClockMapperOptions& clock) : clock_(clock) {}

  [[nodiscard]] Report add(const Pulse& reported) noexcept {
    Report report{reported, any_ && reported.boot != boot_};
    any_ = true;
    boot_ = reported.boot;
    if (reported.mapped) return report;
    if (report.rebooted) clock_.restart();
    const MappedStamp at = clock_.map(reported.edge, reported.arrival);
    report.pulse.mapped = true;
    report.pulse.host = at.host;
    report.pulse.host_error = at.error;
    return report;
  }
  /// Times that the board's clock was found set.
  [[nodiscard]] std::uint64_t clock_resets() const noexcept { return clock_.resets(); }

 private:
  ClockMapper clock_;
  bool any_ = false;
  std::uint32_t boot_ = 0;  // of the newest pulse
};

}  // namespace vergence
