#pragma once
#include <memory>
#include <string>

#include "drivers/common/serial_ins_device.hpp"
#include "drivers/gnss/decoder.hpp"

namespace vergence::gnss {

/// Satellite receiver on a serial link, NMEA 0183 or UBX, with the contract of InsDevice. The
/// driver never writes: messages and rate are the receiver's own settings.
///
/// connect() listens at the requested or the usual baud rates, up to 1.3 s each, and then until the
/// interval of fixes is known. After `disconnected` the link is reopened likewise until fixes
/// arrive. Silence for kSilent counts as disconnected. Readings are mapped: `host` and `host_error`
/// are set (decoder.hpp). Samples have no attitude; heading_source gives the kind of heading.
class Device final : public SerialInsDevice<256> {
 public:
  static constexpr Duration kSilent = Duration::seconds(3);

  Device(std::unique_ptr<SerialLinkFactory> place, const Options& options);
  ~Device() override;

  /// Opens the link and listens. → ok, not_found (silent, or another protocol), no_permission,
  /// busy, disconnected, failed
  [[nodiscard]] DeviceStatus connect();

  /// Returns `unsupported` if the receiver's rate differs.
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
  // Belongs to the thread while it runs, else to the owner.
  Decoder decoder_;
};

}  // namespace vergence::gnss
