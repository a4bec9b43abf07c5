#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/camera.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// A camera's clock on the host's, from its frames.
///
/// From the end of an exposure to the arrival is always as long, from its start not: exposures that
/// grow would look like a clock that drifts. So the clock is fitted to where the frame would have
/// started with the first frame's exposure.
///
/// Not thread-safe. Memory: that of a ClockMapper.
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

/// Quality of a device clock's mapping, from its stamps and where they were mapped to.
///
/// Not thread-safe. Fixed memory. Units: the error of a stamp is a bound.
class ClockRecord {
 public:
  void observe(DeviceStamp device, const MappedStamp& mapped) noexcept {
    constexpr std::uint64_t kSettled = 60;     // stamps after which a clock is known: seconds
    constexpr std::int64_t kOddDrift = 2'000;  // ppm, no crystal: the clock was set
    constexpr Duration kEnough = Duration::seconds(5);  // for a drift that means something
    error_ = mapped.error;
    if (any_ && device > last_device_) {
      const double step = static_cast<double>((device - last_device_).ns()),
                   host = static_cast<double>((mapped.host - last_host_).ns());
      if (std::abs(host - step) > 1e-6 * kOddDrift * step + 20e6) any_ = false;
    } else {
      any_ = false;
    }
    if (!any_) {
      first_device_ = device;
      first_host_ = mapped.host;
      since_ = 0;
    }
    any_ = true;
    ++since_;
    last_device_ = device;
    last_host_ = mapped.host;
    if (since_ > kSettled) worst_ = std::max(worst_, mapped.error);
    const Duration span = last_device_ - first_device_;
    if (since_ > kSettled && span >= kEnough)
      drift_ppm_ = 1e6 * (static_cast<double>((last_host_ - first_host_).ns()) /
                              static_cast<double>(span.ns()) -
                          1);
    ++stamps_;
  }

  /// The device was restarted: its stamps so far say nothing of those to come.
  void restart() noexcept { any_ = false; }

  [[nodiscard]] std::uint64_t stamps() const noexcept { return stamps_; }
  /// Drift of the host clock against the device's, ppm; 0 if unknown.
  [[nodiscard]] double drift_ppm() const noexcept { return drift_ppm_; }
  [[nodiscard]] Duration error() const noexcept { return error_; }  // of the newest stamp
  [[nodiscard]] Duration worst_error() const noexcept {
    return worst_;
  }  // once the clock was known

 private:
  bool any_ = false;
  DeviceStamp first_device_{}, last_device_{};
  HostStamp first_host_{}, last_host_{};
  std::uint64_t stamps_ = 0, since_ = 0;
  double drift_ppm_ = 0;
  Duration error_{}, worst_{};
};

/// Reports of pulses on the host's clock: what the driver has not mapped is mapped here, with a new
/// fit for every boot.
///
/// Not thread-safe. Memory: that of a ClockMapper. Errors: none; a reboot is reported.
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
