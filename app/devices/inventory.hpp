#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/types/time.hpp"
#include "drivers/device.hpp"
#include "drivers/iidc/firewire_nodes.hpp"
#include "drivers/serial/serial_port.hpp"

namespace vergence::app {

/// An IPv4 address of a network interface, in the host's byte order.
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

/// A machine as its own files describe it, and what this process may do on it. The checks read
/// everything through this, so that a folder of small files stands for any machine in tests.
///
/// Threads  here() and group_of: one at a time. Other const calls: any. Memory: ordinary.
/// Errors   Nothing throws. A file that is missing, refuses to be read, is no regular file or holds
///          something else is `nullopt`.
struct Machine {
  /// Bytes that are read of a file: those under /sys hold a page.
  static constexpr std::size_t kMaxText = 4096;
  static constexpr std::size_t kMaxNames = 8192;

  /// Directory with /sys, /proc, /dev and /etc.
  std::filesystem::path root = "/";
  /// User name for the commands that are printed.
  std::string user = "$USER";
  /// Groups of this process, by name.
  std::vector<std::string> groups;
  std::vector<InterfaceAddress> addresses;
  /// Returns true if this process may read and write the node.
  std::function<bool(const std::string& node)> may_use;
  /// Group of a node; empty if unknown.
  std::function<std::string(const std::string& node)> group_of;
  /// For this user; of a folder that does not exist yet, where it would be made.
  std::function<std::optional<DiskRoom>(const std::filesystem::path& folder)> room_at;

  /// The machine that this process runs on.
  [[nodiscard]] static Machine here();

  /// First line without blanks at its ends; what is not printable becomes `?`.
  [[nodiscard]] std::optional<std::string> line(const std::string& path) const;
  /// The whole file, at most kMaxText bytes.
  [[nodiscard]] std::optional<std::string> text(const std::string& path) const;
  /// The first line, which is a number of that base and nothing else.
  [[nodiscard]] std::optional<std::int64_t> number(const std::string& path, int base = 10) const;
  /// Names in a folder, sorted; at most kMaxNames.
  [[nodiscard]] std::vector<std::string> names(const std::string& path) const;
  [[nodiscard]] bool exists(const std::string& path) const;
  /// The path with links followed: `/dev/ttyUSB0`. The path itself where nothing is there, or where
  /// it leads out of this machine.
  [[nodiscard]] std::string target(const std::string& path) const;

  /// Capability `bit` of this process (linux/capability.h).
  [[nodiscard]] bool has_capability(unsigned bit) const;
  [[nodiscard]] bool in_group(const std::string& group) const;

 private:
  [[nodiscard]] std::filesystem::path at(const std::string& path) const;
};

constexpr std::uint16_t kPointGreyVendor = 0x1E10;  // USB vendor id of the IIDC cameras

/// A device on USB as the kernel lists it; nothing is opened.
struct UsbDevice {
  /// `1-2.3`: bus and ports along the path; constant as long as the cable stays.
  std::string port;
  std::uint16_t vendor = 0, product = 0;
  /// The title is manufacturer and product; either may be empty.
  std::string serial, title;
  /// 0 if unknown.
  int bus = 0, number = 0;
  /// Nodes of its interfaces: video0, …
  std::vector<std::string> video;

  [[nodiscard]] std::string node() const;  // /dev/bus/usb/001/004
};

/// Every device but root hubs, in the order of their ports.
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
/// Vendor 0: not on USB.
[[nodiscard]] SerialKind serial_kind(std::uint16_t vendor, std::uint16_t product) noexcept;
/// Returns true for an FTDI chip under whatever vendor id: it has a latency timer.
[[nodiscard]] bool is_ftdi(std::uint16_t vendor, std::uint16_t product) noexcept;

struct FoundPort {
  SerialPortInfo info;
  /// Link that stays when ports are renumbered; empty: none.
  std::string by_id;
  SerialKind kind = SerialKind::unknown;
  /// Line for the configuration; empty: unknown.
  std::string configuration;

  /// The name for a configuration.
  [[nodiscard]] const std::string& name() const noexcept {
    return by_id.empty() ? info.port : by_id;
  }
};

/// Returns true if a configuration's `port` means this port: by its name, any link to it, or its
/// adapter's serial number. An empty key means every port on USB.
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
  /// Names of camera drivers; empty: all.
  std::vector<std::string> drivers;
  /// For each driver of cameras; they search at the same time. The longest search is GigE's, 1 s.
  Duration limit = Duration::seconds(8);
};

/// Looks for everything. One thread a driver; one that does not come back within the limit is
/// abandoned.
[[nodiscard]] Inventory make_inventory(const Machine& machine, const InventoryOptions& options);

/// `{driver: gige, serial: "15021234"}`, as an item of `cameras:`.
[[nodiscard]] std::string camera_line(const DeviceInfo& info);

}  // namespace vergence::app
