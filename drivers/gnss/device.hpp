#pragma once
#include <memory>
#include <string>

#include "drivers/common/serial_ins_device.hpp"
#include "drivers/gnss/decoder.hpp"

namespace vergence::gnss {

/// A satellite receiver on a serial line, NMEA 0183 or UBX. It is listened to, never written to:
/// what it sends and how often is its own setting.
///
/// As InsDevice says. connect() listens at the baud rate asked for or at the usual ones, up to 1.3
/// s each, and then until the interval between fixes is known; so the owner calls it before the
/// drive. After `disconnected` the line is opened again, and listened at likewise, until fixes
/// come. Silent for kSilent is gone.
///
/// Time     Readings are mapped: `host` and `host_error` are set (decoder.hpp).
/// Samples  No attitude; heading_source says what the heading is of.
class Device final : public SerialInsDevice<256> {  // 12 s at 20 Hz
 public:
  static constexpr Duration kSilent = Duration::seconds(3);

  Device(std::unique_ptr<SerialLinkFactory> place, const Options& options);
  ~Device() override;

  /// Opens the line and listens. → ok, not_found (silent, or another protocol), no_permission,
  /// busy, disconnected, failed
  [[nodiscard]] DeviceStatus connect();

  /// `unsupported`: the receiver's rate is another.
  [[nodiscard]] DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override;

 private:
  [[nodiscard]] DeviceStatus open() override;
  [[nodiscard]] DeviceStatus search();
  [[nodiscard]] DeviceStatus find();
  [[nodiscard]] DeviceStatus listen(std::uint32_t baud);
  [[nodiscard]] DeviceStatus measure_rate();
  [[nodiscard]] DeviceStatus read_once(Duration limit, bool discard) noexcept;
  [[nodiscard]] std::string received_instead(std::uint64_t sentences, std::uint64_t frames) const;
  [[nodiscard]] DeviceStatus begin() noexcept override;
  [[nodiscard]] DeviceStatus read_on() noexcept override;
  [[nodiscard]] DeviceStatus reopen() override;
  void count_decoded() noexcept;

  const Options options_;
  bool has_native_usb_ = false;
  Decoder decoder_;  // of the thread while it runs, else the owner's
};

}  // namespace vergence::gnss
