#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "drivers/common/serial_device.hpp"
#include "drivers/ins.hpp"

namespace vergence {

/// INS or satellite receiver on a serial link: all of InsDevice except its protocol. At most kRing
/// readings wait for their consumer.
///
/// States, ownership, threads, memory and errors are those of SerialDevice and InsDevice.
template <std::size_t kRing>
class SerialInsDevice : public InsDevice, protected SerialDevice<InsReading, kRing> {
 public:
  [[nodiscard]] const DeviceInfo& info() const noexcept final { return info_; }
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept final {
    return configured_ ? this->start_thread(ready) : DeviceStatus::bad_configuration;
  }
  void stop() noexcept final { this->stop_thread(); }
  [[nodiscard]] DeviceStatus wait(Duration limit, InsReading* reading) noexcept final {
    const DeviceStatus status = this->pop(limit, reading);
    if (status == DeviceStatus::ok) delivered_.fetch_add(1, std::memory_order_relaxed);
    return status;
  }
  [[nodiscard]] std::string last_error() const final { return last_error_; }
  [[nodiscard]] std::string remark() const final { return remark_; }
  [[nodiscard]] InsStatistics statistics() const noexcept final {
    InsStatistics s;
    s.delivered = delivered_.load(std::memory_order_relaxed);
    s.lost = lost_.load(std::memory_order_relaxed);
    s.malformed = malformed_.load(std::memory_order_relaxed);
    s.restarts = restarts_.load(std::memory_order_relaxed);
    s.overruns = this->overruns();
    s.starts = this->starts();
    return s;
  }

 protected:
  explicit SerialInsDevice(std::unique_ptr<SerialLinkFactory> place)
      : SerialDevice<InsReading, kRing>(std::move(place), "vergence-ins") {
    info_.place = this->place().name();
  }

  /// Opens the link with the device's settings.
  [[nodiscard]] virtual DeviceStatus open() = 0;
  /// Stops the device and opens it again. If not ok, last_error_ has the reason. Call from the
  /// owner's thread.
  [[nodiscard]] DeviceStatus open_anew() {
    stop();
    this->close_line();
    this->query_virtual_time();
    const DeviceStatus status = open();
    if (status != DeviceStatus::ok)
      last_error_ = info_.place + " cannot be opened: " + std::string(to_string(status));
    return status;
  }

  /// Sets the counters to the decoder's totals since the device was opened. Called on the device's
  /// thread, or on the owner's while it does not run.
  void count(std::uint64_t lost, std::uint64_t malformed, std::uint64_t restarts) noexcept {
    lost_.store(lost, std::memory_order_relaxed);
    malformed_.store(malformed, std::memory_order_relaxed);
    restarts_.store(restarts, std::memory_order_relaxed);
  }

  // The following members belong to the owner's thread.
  DeviceInfo info_{};
  std::string last_error_{}, remark_{};
  /// True once start() is allowed.
  bool configured_ = false;
  double rate_hz_ = 0;
  /// Baud rate at which the device last sent data; 0 if unknown. Owned by the same thread as
  /// line().
  std::uint32_t baud_ = 0;

 private:
  std::atomic<std::uint64_t> delivered_{0}, lost_{0}, malformed_{0}, restarts_{0};
};

}  // namespace vergence
