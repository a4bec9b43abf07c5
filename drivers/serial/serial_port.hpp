#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/serial/serial_link.hpp"

namespace vergence {

/// Serial port of this machine with its identification.
struct SerialPortInfo {
  /// Path, as in /dev/ttyUSB0.
  std::string port;
  /// Description by the system.
  std::string description;
  /// 0 if the port is not on USB.
  std::uint16_t usb_vendor = 0, usb_product = 0;
  /// Empty if there is none.
  std::string usb_serial;
  /// Set for FTDI converters.
  std::optional<int> latency_timer_ms;
};

/// Present ports, ordered by name.
[[nodiscard]] std::vector<SerialPortInfo> list_serial_ports();

/// Latency timer of the FTDI converter behind a port (`/dev/ttyUSB0` or a link to it); empty
/// without such a chip.
[[nodiscard]] std::optional<int> read_latency_timer_ms(const std::string& port);

/// True if the port is the device's own USB, so that the baud rate has no effect and bytes have no
/// wire time.
[[nodiscard]] bool is_native_usb(const std::string& port);

/// Finds the port now used by the device that was at `asked` (or a link to it), by its converter's
/// serial number: `asked` if it has the number, else the only one of `ports` that does. If none or
/// several do, returns `asked`, or nothing if `asked` has another number and thus is another
/// device.
[[nodiscard]] std::string port_with_serial(const std::vector<SerialPortInfo>& ports,
                                           const std::string& usb_serial, const std::string& asked);

/// Serial number of the converter of a port at its first opening, if that identifies it. The ports
/// of one converter share a number, and some makers use one number for all: a number ever seen on
/// two ports is not used. opened() must come first; find() is thread-safe.
class ConverterNumber {
 public:
  /// Records the opening of `asked` through a converter with that number. Only the first counts.
  void opened(const std::vector<SerialPortInfo>& ports, const std::string& usb_serial);
  /// Finds the device's present port, as port_with_serial() does.
  [[nodiscard]] std::string find(const std::vector<SerialPortInfo>& ports,
                                 const std::string& asked) const;
  /// True after opened().
  [[nodiscard]] bool decided() const noexcept { return decided_; }
  /// True if find() can identify the converter.
  [[nodiscard]] bool known() const noexcept { return !number_.empty(); }

 private:
  bool decided_ = false;
  std::string number_;
  mutable std::atomic<bool> shared_{false};
};

/// Serial port given by its name, a link to it (/dev/serial/by-id/…) or a plain tty
/// (pseudo-terminal).
///
/// libserialport opens real ports but refuses links and pseudo-terminals; links are resolved, and
/// the others opened as ttys. Reading waits in poll(), because the library's waiting reads spin
/// after a disconnect. A port on USB is found again by its converter's unique serial number, even
/// as another ttyUSB. The port is locked; a second opening is `busy`. Not thread-safe.
class SerialPort final : public SerialLinkFactory {
 public:
  explicit SerialPort(std::string port) : port_(std::move(port)) {}

  [[nodiscard]] std::unique_ptr<SerialLink> open(const LineSettings& settings,
                                                 DeviceStatus* status) override;
  [[nodiscard]] std::string name() const override { return port_; }
  [[nodiscard]] Duration latency_timer() const override;

 private:
  [[nodiscard]] std::string find() const;

  // Name as configured.
  std::string port_;
  ConverterNumber converter_;
};

}  // namespace vergence
