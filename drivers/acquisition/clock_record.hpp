#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/camera.hpp"
#include "drivers/sync/clock_mapper.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Maps a camera's clock to the host's by its frames.
///
/// The delay from the end of an exposure to its arrival is constant, the one from its start is not:
/// growing exposures would appear as drift. So the clock is fitted to stamps shifted by the change
/// of exposure since the first frame. Not thread-safe.
class CameraClock {
 public:
  explicit CameraClock(const ClockMapperOptions& clock) : clock_(clock) {}

  /// Start of the exposure on the host's clock.
  [[nodiscard]] MappedStamp exposure_start(const Frame& frame) noexcept {
    if (exposure_ == Duration{}) exposure_ = frame.exposure;
    const Duration longer = frame.exposure - exposure_;
    MappedStamp start = clock_.map(frame.exposure_start + longer, frame.arrival);
    start.host = start.host - longer;
    return start;
  }
  /// Called after a restart, which changes the camera's clock.
  void restart() noexcept { clock_.restart(); }
  /// Number of detected steps of the clock.
  [[nodiscard]] std::uint64_t resets() const noexcept { return clock_.resets(); }

 private:
  ClockMapper clock_;
  // Exposure of the first frame, for which the minimum delay is valid.
  Duration exposure_{};
};

/// Quality of the mapping of a device's clock. Not thread-safe. Fixed memory.
class ClockRecord {
 public:
  void observe(DeviceStamp device, const MappedStamp& mapped) noexcept {
    // Number of stamps after which the mapping has settled.
    constexpr std::uint64_t kSettled = 60;
    // In ppm; a larger drift means that the clock was set.
    constexpr std::int64_t kOddDrift = 2'000;
    // Minimum span for a meaningful drift.
    constexpr Duration kEnough = Duration::seconds(5);
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

  /// Called after a restart, which makes earlier stamps irrelevant.
  void restart() noexcept { any_ = false; }

  [[nodiscard]] std::uint64_t stamps() const noexcept { return stamps_; }
  /// Drift of the host's clock against the device's, in ppm; 0 if unknown.
  [[nodiscard]] double drift_ppm() const noexcept { return drift_ppm_; }
  /// Error bound of the newest stamp.
  [[nodiscard]] Duration error() const noexcept { return error_; }
  /// Largest error bound after the mapping has settled.
  [[nodiscard]] Duration worst_error() const noexcept { return worst_; }

 private:
  bool any_ = false;
  DeviceStamp first_device_{}, last_device_{};
  HostStamp first_host_{}, last_host_{};
  std::uint64_t stamps_ = 0, since_ = 0;
  double drift_ppm_ = 0;
  Duration error_{}, worst_{};
};

/// Maps reports of pulses to the host's clock if the driver has not, with a new fit for every boot.
/// Not thread-safe.
class PulseMapper {
 public:
  struct Report {
    /// Mapped pulse.
    Pulse pulse{};
    /// True if the previous pulse had another boot.
    bool rebooted = false;
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
  /// Number of detected steps of the trigger board's clock.
  [[nodiscard]] std::uint64_t clock_resets() const noexcept { return clock_.resets(); }

 private:
  ClockMapper clock_;
  bool any_ = false;
  // Boot of the newest pulse.
  std::uint32_t boot_ = 0;
};

}  // namespace vergence
