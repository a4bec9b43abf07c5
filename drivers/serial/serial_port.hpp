#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial/serial_link.hpp"

namespace vergence {

/// A serial port of this machine, for lists and for telling devices apart.
struct SerialPortInfo {
  std::string port;                               // /dev/ttyUSB0
  std::string description;                        // as the system tells it
  std::uint16_t usb_vendor = 0, usb_product = 0;  // 0: not on USB
  std::string usb_serial;                         // empty: none
  std::optional<int> latency_timer_ms;            // of FTDI converters
};

/// Ports that are there now, by name; one that vanishes meanwhile is left out.
[[nodiscard]] std::vector<SerialPortInfo> list_serial_ports();

/// Latency timer of the FTDI converter behind a port (`/dev/ttyUSB0` or a link to it); nothing: no
/// such chip.
[[nodiscard]] std::optional<int> read_latency_timer_ms(const std::string& port);

/// The port is the device's own USB: its baud rate is a word without meaning, and bytes take no
/// time on a line.
[[nodiscard]] bool is_native_usb(const std::string& port);

/// Where the device that was at port `asked` (or a link to it) is now, by its converter's serial
/// number: at `asked`, if that bears the number; else at the only one of `ports` that does. Where
/// none or several do, `asked`, or nothing if that bears another number: a port of another device
/// must not be taken for it.
[[nodiscard]] std::string port_with_serial(const std::vector<SerialPortInfo>& ports,
                                           const std::string& usb_serial, const std::string& asked);

/// The serial number of the converter that a port was first opened through, as far as it tells that
/// converter from others. The ports of one converter share theirs, and some makers give all of
/// theirs the same: where two were ever seen with it, the other may be the only one the next time.
/// Threads  opened(): the first one before all else. find(): any.
class ConverterNumber {
 public:
  /// `asked` was opened, through a converter of that number. The first opening counts.
  void opened(const std::vector<SerialPortInfo>& ports, const std::string& usb_serial);
  /// Where the device is now, as port_with_serial().
  [[nodiscard]] std::string find(const std::vector<SerialPortInfo>& ports,
                                 const std::string& asked) const;
  /// opened() was called.
  [[nodiscard]] bool decided() const noexcept { return decided_; }
  /// find() has something to look for.
  [[nodiscard]] bool known() const noexcept { return !number_.empty(); }

 private:
  bool decided_ = false;
  std::string number_;
  mutable std::atomic<bool> shared_{false};
};

/// A serial port by its name, a link to it (/dev/serial/by-id/…), or a plain tty (a
/// pseudo-terminal).
///
/// Real ports are opened and set through libserialport, which refuses links and pseudo-terminals:
/// links are resolved, the others are opened as ttys. Reading waits in poll(): the library's own
/// waiting reads spin after an unplug. A port on USB is remembered by the converter's serial number
/// from its first opening, if no other port bears it: a device that comes back as ttyUSB1 is found.
/// The port is held exclusively; a second opening is `busy`.
///
/// Not thread-safe. Memory: ordinary; the lines as SerialLink says.
class SerialPort final : public SerialLinkFactory {
 public:
  explicit SerialPort(std::string port) : port_(std::move(port)) {}

  [[nodiscard]] std::unique_ptr<SerialLink> open(const LineSettings& settings,
                                                 DeviceStatus* status) override;
  [[nodiscard]] std::string name() const override { return port_; }
  [[nodiscard]] Duration latency_timer() const override;

 private:
  [[nodiscard]] std::string find() const;

  std::string port_;  // as asked for
  ConverterNumber converter_;
};

}  // namespace vergence
