#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/common/serial_ins_device.hpp"
#include "drivers/xsens/decoder.hpp"
#include "drivers/xsens/setup.hpp"

namespace vergence::xsens {

/// An XSens MTi-G or MTi-G-700/710 on a serial line.
///
/// As InsDevice says. configure() finds the device (baud scan), sets what differs, and may take
/// seconds; so the owner calls it before the drive. start() never waits: a thread of the device's
/// own puts it into measurement, reads, and after `disconnected` opens and sets it again until it
/// is back. A device that sends no sample for kSilent, or four of its intervals, is one that is
/// gone, also where it sends something else: it may have lost its settings. So is one that tells of
/// a restart. Time  Readings are mapped: `host` and `host_error` are set (decoder.hpp).
class Device final : public SerialInsDevice<1024> {  // readings: 2.5 s at 400 Hz
 public:
  static constexpr Duration kSilent = Duration::seconds(2);

  Device(std::unique_ptr<SerialLinkFactory> place, const Options& options);
  ~Device() override;

  /// Opens the line, finds the device and asks who it is; leaves it in its configuration state. →
  /// ok, not_found, no_permission, busy, unsupported (another make), disconnected, failed
  [[nodiscard]] DeviceStatus connect();

  [[nodiscard]] DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override;
  /// Supported by MTi-G-700/710, whose clock continues; others: `unsupported`.
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
  Decoder decoder_;                      // of the thread while it runs, else the owner's
  HostStamp last_sample_{};              // the thread's: its arrival, or when it was waited for
  std::atomic<std::int64_t> gap_ns_{0};  // that is to be made; 0: none
};

}  // namespace vergence::xsens
