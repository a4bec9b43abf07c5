#include "app/publish/address.hpp"

#include <sys/un.h>

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kLongestHost = 253;  // a name of the domain name system

bool host_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '-' || c == '_';
}

bool address_letter(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F') || c == ':' ||
         c == '.';
}

}  // namespace

bool HostPort::loopback() const {
  return host == "localhost" || host == "::1" ||
         (host.starts_with("127.") && std::all_of(host.begin(), host.end(), address_letter));
}

std::string HostPort::text() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

HostPort parse_host_port(std::string_view text, std::string_view key) {
  const auto refuse = [&]() -> HostPort {
    throw InputError(
        fmt::format("{}: \"{}\" is no address; give HOST:PORT, e.g. 127.0.0.1:8080 or [::1]:8080",
                    key, text.substr(0, 120)));
  };
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return refuse();
  std::string_view host = text.substr(0, colon), digits = text.substr(colon + 1);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  if (host.empty() || host.size() > kLongestHost ||
      !std::all_of(host.begin(), host.end(), bracketed ? address_letter : host_letter))
    return refuse();
  unsigned port = 0;
  const auto end = digits.data() + digits.size();
  const auto [read, error] = std::from_chars(digits.data(), end, port);
  if (error != std::errc() || read != end || port < 1 || port > 65535) return refuse();
  return {std::string(host), static_cast<std::uint16_t>(port)};
}

LineAddress parse_line_address(std::string_view text, std::string_view key) {
  constexpr std::string_view kUnix = "unix://", kUdp = "udp://";
  LineAddress out;
  if (text.starts_with(kUdp)) {
    out.kind = LineAddress::Kind::udp;
    out.udp = parse_host_port(text.substr(kUdp.size()), key);
    return out;
  }
  if (!text.starts_with(kUnix))
    throw InputError(
        fmt::format("{}: \"{}\" is no place for lines; give unix:///PATH or udp://HOST:PORT", key,
                    text.substr(0, 120)));
  out.path = text.substr(kUnix.size());
  if (!out.path.starts_with('/') || out.path.find('\0') != std::string::npos ||
      out.path.size() >= sizeof(sockaddr_un::sun_path))
    throw InputError(fmt::format("{}: the path of a socket begins with / and has at most {} bytes",
                                 key, sizeof(sockaddr_un::sun_path) - 1));
  return out;
}

}  // namespace vergence::app
