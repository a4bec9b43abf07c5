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
  std::optional<std::uint64_t>
      files;  // that may still be made; nothing: the file system has no limit
  bool read_only = false;
  bool may_write = true;  // by owner and mode
};

/// A machine as its own files tell it, and what this process may do on it. Everything that `doctor`
/// judges is read through this, so that a folder of small files stands for any machine in tests.
///
/// Threads  Const calls: any. Memory: ordinary.
/// Errors   Nothing throws. A file that is missing, refuses to be read, is no regular file or holds
///          something else is `nullopt`.
struct Machine {
  static constexpr std::size_t kMostText =
      4096;  // bytes that are read of a file: those under /sys hold a page

  std::filesystem::path root = "/";  // /sys, /proc, /dev and /etc are looked for below it
  std::string user = "$USER";        // for commands
  std::vector<std::string> groups;   // of this process, by name
  std::vector<InterfaceAddress> addresses;
  std::function<bool(const std::string& node)> may_use;  // may this process read and write it?
  std::function<std::string(const std::string& node)> group_of;  // of a node; empty: not known
  std::function<std::optional<unsigned>(const std::string& node)> mode_of;  // 0660
  /// For this user; of a folder that is not there yet, where it would be made.
  std::function<std::optional<DiskRoom>(const std::filesystem::path& folder)> room_at;
  std::optional<bool> clock_synchronised;  // as the kernel was told

  /// The one that this runs on.
  [[nodiscard]] static Machine here();

  /// First line without blanks at its ends; what is not printable becomes `?`.
  [[nodiscard]] std::optional<std::string> line(const std::string& path) const;
  /// All of it, at most kMostText bytes.
  [[nodiscard]] std::optional<std::string> text(const std::string& path) const;
  /// The first line, which is a decimal number and nothing else.
  [[nodiscard]] std::optional<std::int64_t> number(const std::string& path) const;
  /// The first line, which is a hexadecimal number below 2^16 and nothing else: ids of USB.
  [[nodiscard]] std::optional<std::uint16_t> hex16(const std::string& path) const;
  /// Names in a folder, sorted; at most kMostNames.
  [[nodiscard]] std::vector<std::string> names(const std::string& path) const;
  [[nodiscard]] bool exists(const std::string& path) const;
  /// What a path is in the end, links followed: `/dev/ttyUSB0`. The path itself where nothing is
  /// there, or what it leads to is outside of this machine.
  [[nodiscard]] std::string target(const std::string& path) const;

  /// Whether a process with that name runs (the first 15 letters count).
  [[nodiscard]] bool runs(const std::string& name) const;
  /// Capability `bit` of this process (linux/capability.h).
  [[nodiscard]] bool has_capability(unsigned bit) const;
  /// Soft limit of this process by its name in /proc/self/limits; -1: unlimited.
  [[nodiscard]] std::optional<std::int64_t> limit(const std::string& name) const;
  [[nodiscard]] bool in_group(const std::string& group) const;
  /// In /etc/group, whatever this process has: then a new login is all that is missing.
  [[nodiscard]] bool listed_in_group(const std::string& group) const;

  static constexpr std::size_t kMostNames = 8192;

 private:
  [[nodiscard]] std::filesystem::path at(const std::string& path) const;
};

}  // namespace vergence::app
