#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace vergence::app {

/// HOST:PORT of the configuration; an IPv6 address stands in brackets.
struct HostPort {
  std::string host{};
  std::uint16_t port = 0;

  /// Reachable from this machine alone: 127.0.0.0/8, ::1, localhost.
  [[nodiscard]] bool loopback() const;
  /// As it stands in a URL: brackets around an IPv6 address.
  [[nodiscard]] std::string text() const;
  /// What a viewer opens: where the host is every address (0.0.0.0, ::), this machine's name.
  [[nodiscard]] HostPort link() const;
};

/// Where the lines go.
struct LineAddress {
  enum class Kind : std::uint8_t { unix_socket, udp } kind = Kind::unix_socket;
  std::string path{};  // of the socket file
  HostPort udp{};
};

/// `127.0.0.1:8080`, `[::1]:8080`, `0.0.0.0:8080`, `name:8080`. InputError: a sentence that begins
/// with `key`.
[[nodiscard]] HostPort parse_host_port(std::string_view text, std::string_view key);

/// `unix:///run/vergence/pose.sock`, `udp://HOST:PORT`. InputError: a sentence that begins with
/// `key`.
[[nodiscard]] LineAddress parse_line_address(std::string_view text, std::string_view key);

}  // namespace vergence::app
