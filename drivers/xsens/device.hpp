#pragma once
#include <atomic>
#include <memory>
#include <string>

#include "drivers/common/serial_device.hpp"
#include "drivers/ins.hpp"
#include "drivers/xsens/decoder.hpp"
#include "drivers/xsens/setup.hpp"

namespace vergence::xsens {

/// An XSens MTi-G or MTi-G-700/710 on a serial line.
///
/// As InsDevice says. configure() finds the device (baud scan), sets what differs, and may take
/// seconds; so the owner calls it before the drive. start() never waits: a thread of the device's
/// own puts it into measurement, reads, and after `gone` opens and sets it again until it is back.
/// A silent device (kSilent) is one that is gone.
/// Time  Readings are mapped: `host` and `host_error` are set (decoder.hpp).
class Device final : public InsDevice,
                     private SerialDevice<InsReading, 1024> {  // readings: 2.5 s at 400 Hz
 public:
  static constexpr Duration kSilent = Duration::seconds(2);

  Device(std::unique_ptr<LinePlace> place, const Options& options);
  ~Device() override;

  /// Opens the line, finds the device and asks who it is; leaves it in its configuration state. →
  /// ok, not_found, no_permission, busy, unsupported (another make), gone, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
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

  [[nodiscard]] const Identity& identity() const noexcept { return identity_; }
  [[nodiscard]] const StreamSettings& stream() const noexcept { return set_; }

 private:
  [[nodiscard]] DeviceStatus open();
  [[nodiscard]] std::string remark_about(double rate_hz) const;
  [[nodiscard]] DeviceStatus begin() noexcept override;
  [[nodiscard]] DeviceStatus read_on() noexcept override;
  [[nodiscard]] DeviceStatus reopen() override;
  void count() noexcept;

  const Options options_;
  DeviceInfo info_;
  Identity identity_{};
  StreamSettings set_{};
  double rate_hz_ = 0;
  std::uint32_t baud_ = 0;  // at which the device last sent something; 0: not yet
  bool configured_ = false;
  std::string last_error_, remark_;

  Decoder decoder_;  // of the thread while it runs, else the owner's
  std::atomic<std::uint64_t> delivered_{0}, lost_{0}, malformed_{0}, restarts_{0};
};

}  // namespace vergence::xsens
