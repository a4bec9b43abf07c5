#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "app/runtime/file_descriptor.hpp"
#include "core/types/time.hpp"

namespace vergence::app {

/// HOST:PORT of the configuration; an IPv6 address stands in brackets.
struct HostPort {
  std::string host{};
  std::uint16_t port = 0;

  /// Reachable from this machine alone: 127.0.0.0/8, ::1, localhost.
  [[nodiscard]] bool loopback() const;
  /// As it stands in a URL: brackets around an IPv6 address.
  [[nodiscard]] std::string text() const;
  /// Address for viewers: the machine's name if the host is every address (0.0.0.0, ::).
  [[nodiscard]] HostPort link() const;
};

/// Where the lines go.
struct LineAddress {
  enum class Kind : std::uint8_t { unix_socket, udp } kind = Kind::unix_socket;
  std::string path{};  // of the socket file
  HostPort udp{};
};

/// `127.0.0.1:8080`, `[::1]:8080`, `0.0.0.0:8080`, `name:8080`. InputError: a message that begins
/// with `key`.
[[nodiscard]] HostPort parse_host_port(std::string_view text, std::string_view key);

/// `unix:///run/vergence/pose.sock`, `udp://HOST:PORT`. InputError: a message that begins with
/// `key`.
[[nodiscard]] LineAddress parse_line_address(std::string_view text, std::string_view key);

/// Counters of the lines at the socket.
struct LineSocketCounters {
  std::uint64_t sent = 0;     // lines that a reader was given, each reader counted
  std::uint64_t refused = 0;  // lines that a reader had no room for, or that had no reader (UDP)
  std::uint64_t readers = 0;  // connections that were accepted
  std::uint64_t closed = 0;   // … and closed because the reader did not read
  std::uint64_t turned_away = 0;  // … and closed because there were too many
  std::uint64_t images = 0;       // pairs of images that a reader was given, each reader counted
};

/// Response to a request.
struct LineResponse {
  std::string line{};  // line feed included
  /// Positive: the reader gets images from now on, one pair per interval on average and never two
  /// within half of it, and no more lines.
  Duration image_interval{};
};

/// Where lines go: a Unix stream socket with a few readers, or datagrams to one address.
///
/// Not thread-safe. Sending never waits: a reader without room loses whole lines, never a part
///          of one, and is disconnected when it does not read for a while.
/// Errors   The constructors throw InputError: what, where, what to do. Afterwards counters.
class LineSocket {
 public:
  /// `request`: without its line feed.
  using Answer = std::function<LineResponse(std::string_view request)>;

  virtual ~LineSocket() = default;
  virtual void send(std::string_view line) noexcept = 0;
  /// Lines that every reader is given now, and readers that connect later are given first. They are
  /// never lost: a reader without room gets them as soon as it has.
  virtual void greet(std::string lines) noexcept = 0;
  /// Returns when `wake`, an eventfd, was written to, which is then reset, or after `timeout`, or
  /// earlier. Readers are accepted and their requests answered meanwhile; datagrams bring none.
  virtual void wait(int wake, Duration timeout, const Answer& answer) noexcept = 0;
  /// True while a reader has room for images and its interval has passed.
  [[nodiscard]] virtual bool wants_images() const noexcept { return false; }
  /// Gives them to those readers. `bytes`: a frame's images (docs/live_interface.md).
  virtual void send_images(std::string_view /*bytes*/) noexcept {}
  [[nodiscard]] virtual LineSocketCounters counters() const noexcept = 0;
};

/// `key` begins the message of an InputError.
[[nodiscard]] std::unique_ptr<LineSocket> open_line_socket(const LineAddress& address,
                                                           std::string_view key);

}  // namespace vergence::app
