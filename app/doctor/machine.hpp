#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vergence::app {

/// An IPv4 address of a network interface, in the host's byte order.
struct InterfaceAddress {
  std::string name;
  std::uint32_t address = 0, mask = 0;
};

/// What a folder's file system takes of this process.
struct DiskRoom {
  std::uint64_t bytes = 0;  // free
  bool read_only = false;
  bool may_write = true;  // by owner and mode
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

  std::filesystem::path root = "/";  // /sys, /proc, /dev and /etc are looked for below it
  std::string user = "$USER";        // for commands
  std::vector<std::string> groups;   // of this process, by name
  std::vector<InterfaceAddress> addresses;
  /// Returns true if this process may read and write the node.
  std::function<bool(const std::string& node)> may_use;
  /// Group of a node; empty if unknown.
  std::function<std::string(const std::string& node)> group_of;
  /// For this user; of a folder that does not exist yet, where it would be made.
  std::function<std::optional<DiskRoom>(const std::filesystem::path& folder)> room_at;
  std::optional<bool> clock_synchronised;  // as the kernel was told

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
  /// Soft limit of this process by its name in /proc/self/limits; -1: unlimited.
  [[nodiscard]] std::optional<std::int64_t> limit(const std::string& name) const;
  [[nodiscard]] bool in_group(const std::string& group) const;

 private:
  [[nodiscard]] std::filesystem::path at(const std::string& path) const;
};

}  // namespace vergence::app
