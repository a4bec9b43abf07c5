#pragma once
#include <netdb.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

#include "app/runtime/errors.hpp"
#include "app/runtime/file_descriptor.hpp"
#include "core/types/time.hpp"

namespace vergence::app {

/// HOST:PORT of the configuration; an IPv6 address is in brackets.
struct HostPort {
  std::string host{};
  std::uint16_t port = 0;

  /// True if reachable only from this machine: 127.0.0.0/8, ::1, localhost.
  [[nodiscard]] bool loopback() const;
  /// Form used in a URL, with brackets around an IPv6 address.
  [[nodiscard]] std::string text() const;
  /// Address for viewers: the machine's name if the host is every address (0.0.0.0, ::).
  [[nodiscard]] HostPort link() const;
};

/// First address of a host name or number for that type of socket. Throws the result of
/// `refuse(reason)`.
[[nodiscard]] std::unique_ptr<addrinfo, void (*)(addrinfo*)> resolve(
    const HostPort& address, int type, const std::function<InputError(const char* reason)>& refuse);

/// Destination of the lines.
struct LineAddress {
  enum class Kind : std::uint8_t { unix_socket, udp } kind = Kind::unix_socket;
  /// Path of the socket file.
  std::string path{};
  HostPort udp{};
};

/// Parses `127.0.0.1:8080`, `[::1]:8080`, `0.0.0.0:8080` or `name:8080`. Throws InputError with a
/// message that begins with `key`.
[[nodiscard]] HostPort parse_host_port(std::string_view text, std::string_view key);

/// Parses `unix:///run/vergence/pose.sock` or `udp://HOST:PORT`. Throws InputError with a message
/// that begins with `key`.
[[nodiscard]] LineAddress parse_line_address(std::string_view text, std::string_view key);

/// Counters of the socket.
struct LineSocketCounters {
  /// Lines delivered, counted per reader.
  std::uint64_t sent = 0;
  /// Lines for which a reader had no room, or UDP had no reader.
  std::uint64_t refused = 0;
  /// Accepted connections.
  std::uint64_t readers = 0;
  /// Connections closed because the reader did not read.
  std::uint64_t closed = 0;
  /// Connections closed because there were too many.
  std::uint64_t turned_away = 0;
  /// Pairs of images delivered, counted per reader.
  std::uint64_t images = 0;
};

/// Response to a request.
struct LineResponse {
  /// Includes the line feed.
  std::string line{};
  /// If positive, the reader gets images instead of lines from now on, one pair per interval on
  /// average and at least half of it apart.
  Duration image_interval{};
};

/// Destination of lines: a Unix stream socket with a few readers, or datagrams to one address.
///
/// Sending never blocks: a reader without room loses whole lines and is disconnected if it does not
/// read for a while. Not thread-safe. The constructors throw InputError with the problem, its place
/// and the fix; later errors are counted.
class LineSocket {
 public:
  /// `request` has no line feed.
  using Answer = std::function<LineResponse(std::string_view request)>;

  virtual ~LineSocket() = default;
  virtual void send(std::string_view line) noexcept = 0;
  /// Sets lines that every reader gets now and later readers get first. They are never lost: a
  /// reader without room gets them when it has some.
  virtual void greet(std::string lines) noexcept = 0;
  /// Waits until the eventfd `wake` was written, which resets it, or at most for `timeout`.
  /// Meanwhile accepts readers and answers their requests; datagrams have none.
  virtual void wait(int wake, Duration timeout, const Answer& answer) noexcept = 0;
  /// True while a reader has room for images and its interval has passed.
  [[nodiscard]] virtual bool wants_images() const noexcept { return false; }
  /// Sends to those readers. `bytes` has a frame's images (docs/live_interface.md).
  virtual void send_images(std::string_view /*bytes*/) noexcept {}
  [[nodiscard]] virtual LineSocketCounters counters() const noexcept = 0;
};

/// `key` begins the message of an InputError.
[[nodiscard]] std::unique_ptr<LineSocket> open_line_socket(const LineAddress& address,
                                                           std::string_view key);

}  // namespace vergence::app
