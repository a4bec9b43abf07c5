#pragma once
#include <cstdint>
#include <memory>
#include <string_view>

#include "app/publish/address.hpp"

namespace vergence::app {

/// What became of the lines at the socket.
struct LineSocketCounters {
  std::uint64_t sent = 0;     // lines that a reader was given, each reader counted
  std::uint64_t refused = 0;  // lines that a reader had no room for, or nobody listened to (UDP)
  std::uint64_t readers = 0;  // connections that were accepted
  std::uint64_t closed = 0;   // … and closed because the reader did not read
  std::uint64_t turned_away = 0;  // … and closed because there were too many
};

/// Where lines go: a Unix stream socket with a few readers, or datagrams to one address.
///
/// Threads  One caller. Nothing waits: a reader without room loses whole lines, never a part of
///          one, and is disconnected when it does not read for a while.
/// Errors   The constructors throw InputError: what, where, what to do. Afterwards counters.
class LineSocket {
 public:
  virtual ~LineSocket() = default;
  virtual void send(std::string_view line) noexcept = 0;
  [[nodiscard]] virtual LineSocketCounters counters() const noexcept = 0;
};

/// `key` begins the sentence of an InputError.
[[nodiscard]] std::unique_ptr<LineSocket> open_line_socket(const LineAddress& address,
                                                           std::string_view key);

}  // namespace vergence::app
