#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/types/time.hpp"
#include "drivers/iidc/firewire_nodes.hpp"
#include "drivers/serial/serial_port.hpp"

namespace vergence::app {

/// IPv4 address of a network interface, in host byte order.
struct InterfaceAddress {
  std::string name;
  std::uint32_t address = 0, mask = 0;
};

/// Writability and free space of a directory for this process.
struct DiskRoom {
  /// Free bytes.
  std::uint64_t bytes = 0;
  bool read_only = false;
  /// Write permission by owner and mode.
  bool may_write = true;
};

/// Machine as described by its files, and the rights of this process. All checks use this
/// interface, so tests can replace a machine by a directory.
///
/// here() and group_of are not thread-safe, other const calls are. Nothing throws. A file that is
/// missing, unreadable, not regular or malformed gives `nullopt`.
struct Machine {
  /// Maximum number of bytes read of a file; those under /sys have a page.
  static constexpr std::size_t kMaxText = 4096;
  static constexpr std::size_t kMaxNames = 8192;

  /// Directory with /sys, /proc, /dev and /etc.
  std::filesystem::path root = "/";
  /// User name for printed commands.
  std::string user = "$USER";
  /// Groups of this process, by name.
  std::vector<std::string> groups;
  std::vector<InterfaceAddress> addresses;
  /// Returns true if this process may read and write the node.
  std::function<bool(const std::string& node)> may_use;
  /// Group of a node; empty if unknown.
  std::function<std::string(const std::string& node)> group_of;
  /// Free space for this user; of a directory that does not exist yet, that of its future parent.
  std::function<std::optional<DiskRoom>(const std::filesystem::path& folder)> room_at;
  /// State that the kernel reports.
  std::optional<bool> clock_synchronised;

  /// Machine of this process.
  [[nodiscard]] static Machine here();

  /// First line without surrounding blanks; unprintable characters become `?`.
  [[nodiscard]] std::optional<std::string> line(const std::string& path) const;
  /// Whole file, at most kMaxText bytes.
  [[nodiscard]] std::optional<std::string> text(const std::string& path) const;
  /// First line, if it is just a number of that base.
  [[nodiscard]] std::optional<std::int64_t> number(const std::string& path, int base = 10) const;
  /// Names in a directory, sorted; at most kMaxNames.
  [[nodiscard]] std::vector<std::string> names(const std::string& path) const;
  [[nodiscard]] bool exists(const std::string& path) const;
  /// Path with links resolved, such as `/dev/ttyUSB0`. Unchanged if nothing is there, or it leads
  /// out of `root`.
  [[nodiscard]] std::string target(const std::string& path) const;

  /// Capability `bit` of this process (linux/capability.h).
  [[nodiscard]] bool has_capability(unsigned bit) const;
  /// Soft limit of this process by its name in /proc/self/limits; -1: unlimited.
  [[nodiscard]] std::optional<std::int64_t> limit(const std::string& name) const;
  [[nodiscard]] bool in_group(const std::string& group) const;

 private:
  [[nodiscard]] std::filesystem::path at(const std::string& path) const {
    return root / std::filesystem::path(path).relative_path();
  }
};

/// USB vendor id of the IIDC cameras.
constexpr std::uint16_t kPointGreyVendor = 0x1E10;

/// USB device as listed by the kernel; it is not opened.
struct UsbDevice {
  /// Bus and ports along the path, such as `1-2.3`; constant while the cable stays.
  std::string port;
  std::uint16_t vendor = 0, product = 0;
  /// The title is manufacturer and product; either may be empty.
  std::string serial, title{};
  /// 0 if unknown.
  int bus = 0, number = 0;
  /// Nodes of its interfaces: video0, …
  std::vector<std::string> video{};

  /// Path such as /dev/bus/usb/001/004.
  [[nodiscard]] std::string node() const {
    return fmt::format("/dev/bus/usb/{:03}/{:03}", bus, number);
  }
};

/// All devices except root hubs, ordered by port.
[[nodiscard]] std::vector<UsbDevice> list_usb_devices(const Machine& machine);

/// Likely device at a serial port, by the USB ids of what carries it. The port is not
/// opened, because that resets many boards. The values are keys of `devices --json`.
enum class SerialKind : std::uint8_t {
  /// Converter of XSens, or an MTi with USB.
  ins,
  /// FTDI converter with any device, often an MTi.
  ftdi,
  /// Converter of another maker.
  converter,
  /// Microcontroller board, which may be the trigger board.
  board,
  /// Port that is not on USB.
  built_in,
  unknown,
};
[[nodiscard]] const char* to_string(SerialKind) noexcept;
/// Vendor 0 means a port that is not on USB.
[[nodiscard]] SerialKind serial_kind(std::uint16_t vendor, std::uint16_t product) noexcept;
/// True for an FTDI chip under any vendor id; it has a latency timer.
[[nodiscard]] bool is_ftdi(std::uint16_t vendor, std::uint16_t product) noexcept;

struct FoundPort {
  SerialPortInfo info{};
  /// Link that is stable when ports are renumbered; empty if there is none.
  std::string by_id{};
  SerialKind kind = SerialKind::unknown;
  /// Line for the configuration; empty if unknown.
  std::string configuration{};

  /// Name for a configuration.
  [[nodiscard]] const std::string& name() const noexcept {
    return by_id.empty() ? info.port : by_id;
  }
};

/// True if a configuration's `port` matches this port: by name, any link to it, or the adapter's
/// serial number. An empty key matches every port on USB.
[[nodiscard]] bool names_port(const Machine& machine, const std::string& key,
                              const FoundPort& port);

/// Devices found by one driver.
struct DriverFindings {
  std::string name, meaning;
  /// False if the search took longer than the limit.
  bool answered = true;
  std::vector<DeviceInfo> cameras;
  /// Reason why there is no camera; may be empty.
  std::string explanation;
};

struct Inventory {
  std::vector<DriverFindings> drivers;
  std::vector<FoundPort> ports;
  std::vector<UsbDevice> usb;
  /// FireWire cameras.
  std::vector<iidc::FirewireNode> firewire;
};

struct InventoryOptions {
  /// Names of camera drivers; empty for all.
  std::vector<std::string> drivers;
  /// Time limit of each driver's search; searches run in parallel. The longest is GigE's, 1 s.
  Duration limit = Duration::seconds(8);
};

/// Searches for all devices with one thread per driver; a search beyond the limit is abandoned.
[[nodiscard]] Inventory make_inventory(const Machine& machine, const InventoryOptions& options);

/// Item of `cameras`, such as `{driver: gige, serial: "15021234"}`.
[[nodiscard]] std::string camera_line(const DeviceInfo& info);

}  // namespace vergence::app
