#pragma once
#include <atomic>
#include <memory>
#include <string>

#include "drivers/common/serial_device.hpp"
#include "drivers/gnss/decoder.hpp"
#include "drivers/ins.hpp"

namespace vergence::gnss {

/// A satellite receiver on a serial line, NMEA 0183 or UBX. It is listened to, never written to:
/// what it sends and how often is its own setting.
///
/// As InsDevice says. connect() listens at the baud rate asked for or at the usual ones, up to 1.3
/// s each, and then until the interval between fixes is known; so the owner calls it before the
/// drive. After `gone` the line is opened again until fixes come. Silent for kSilent is gone. Time
/// Readings are mapped: `host` and `host_error` are set (decoder.hpp). Samples  No attitude;
/// heading_source says what the heading is of.
class Device final : public InsDevice, private SerialDevice<InsReading, 256> {  // 12 s at 20 Hz
 public:
  static constexpr Duration kSilent = Duration::seconds(3);

  Device(std::unique_ptr<LinePlace> place, const Options& options);
  ~Device() override;

  /// Opens the line and listens. → ok, not_found (silent, or another protocol), no_permission,
  /// busy, gone, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  /// `unsupported`: the receiver's rate is another.
  [[nodiscard]] DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override;
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept override;
  [[nodiscard]] DeviceStatus wait(Duration limit, InsReading* reading) noexcept override;
  void stop() noexcept override;
  bool observe_line(LineObserver* observer) noexcept override {
    log().observe(observer);
    return true;
  }
  [[nodiscard]] std::string last_error() const override { return last_error_; }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] bool keeps_own_time() const noexcept override { return virtual_time(); }
  [[nodiscard]] InsStatistics statistics() const noexcept override;

 private:
  [[nodiscard]] DeviceStatus open();
  [[nodiscard]] DeviceStatus find();
  [[nodiscard]] DeviceStatus listen(std::uint32_t baud);
  [[nodiscard]] DeviceStatus measure_rate();
  [[nodiscard]] DeviceStatus read_once(Duration limit, bool discard) noexcept;
  [[nodiscard]] std::string received_instead(std::uint64_t sentences, std::uint64_t frames) const;
  [[nodiscard]] DeviceStatus begin() noexcept override;
  [[nodiscard]] DeviceStatus read_on() noexcept override;
  [[nodiscard]] DeviceStatus reopen() override;
  void count() noexcept;

  const Options options_;
  DeviceInfo info_;
  std::uint32_t baud_ = 0;  // at which the receiver last sent something; 0: not yet
  double rate_hz_ = 0;      // measured
  bool configured_ = false, has_native_usb_ = false;
  std::string last_error_, remark_;
  Decoder decoder_;  // of the thread while it runs, else the owner's
  std::atomic<std::uint64_t> delivered_{0}, lost_{0}, malformed_{0}, restarts_{0};
};

}  // namespace vergence::gnss
