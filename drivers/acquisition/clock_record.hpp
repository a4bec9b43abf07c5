#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/sync/clock_mapper.hpp"

namespace vergence {

/// How well a device's clock was known over a drive, from its stamps and where they were mapped to.
///
/// Threads  One. Memory: fixed. Units: the error of a stamp is a bound.
class ClockRecord {
 public:
  void note(DeviceStamp device, const MappedStamp& mapped) noexcept {
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
  /// Of the host's clock against the device's, ppm; 0 where nothing is known.
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

}  // namespace vergence
