#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/common/serial_ins_device.hpp"
#include "drivers/xsens/decoder.hpp"
#include "drivers/xsens/setup.hpp"

namespace vergence::xsens {

/// XSens MTi-G or MTi-G-700/710 on a serial link, with the contract of InsDevice.
///
/// configure() finds the device (baud scan) and changes differing settings, which may take seconds.
/// start() returns immediately: a thread starts measurement, reads, and after `disconnected`
/// reopens and configures the device again. A device without a sample for kSilent or four intervals
/// counts as disconnected even if it sends other data, because it may have lost its settings; so
/// does one that reports a restart. Samples are mapped: `host` and `host_error` are set
/// (decoder.hpp).
class Device final : public SerialInsDevice<1024> {
 public:
  static constexpr Duration kSilent = Duration::seconds(2);

  Device(std::unique_ptr<SerialLinkFactory> place, const Options& options);
  ~Device() override;

  /// Opens the link and identifies the device; leaves it in its configuration state. → ok,
  /// not_found, no_permission, busy, unsupported (another make), disconnected, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override;
  /// Supported by MTi-G-700/710, whose clock continues; others return `unsupported`.
  [[nodiscard]] DeviceStatus pause(Duration gap) noexcept override;

  [[nodiscard]] const Identity& identity() const noexcept { return identity_; }
  [[nodiscard]] const StreamSettings& stream() const noexcept { return set_; }

 private:
  [[nodiscard]] DeviceStatus open() override;
  [[nodiscard]] std::string remark_about(double rate_hz) const;
  [[nodiscard]] DeviceStatus begin() noexcept override;
  [[nodiscard]] DeviceStatus read_on() noexcept override;
  [[nodiscard]] DeviceStatus reopen() override;
  void finished() noexcept override;
  [[nodiscard]] DeviceStatus read_once(Duration limit) noexcept;
  [[nodiscard]] DeviceStatus make_gap(Duration gap) noexcept;
  [[nodiscard]] DeviceStatus announce(xbus::MessageId request) noexcept;
  [[nodiscard]] Duration silent_after() const noexcept;
  void count_decoded() noexcept;

  const Options options_;
  Identity identity_{};
  StreamSettings set_{};
  // Belongs to the thread while it runs, else to the owner.
  Decoder decoder_;
  // Arrival of the last sample, or start of waiting for one. Used by the thread.
  HostStamp last_sample_{};
  // Duration of a requested gap; 0 if none.
  std::atomic<std::int64_t> gap_ns_{0};
};

}  // namespace vergence::xsens
