#include "app/publish/address.hpp"

#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// What another computer may know this machine by.
std::string machine_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 && name[0] != 0 ? name.data()
                                                                          : "localhost";
}

}  // namespace

bool HostPort::loopback() const {
  return host == "localhost" || host == "::1" ||
         (host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string::npos);
}

std::string HostPort::text() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

HostPort HostPort::link() const {
  return host == "0.0.0.0" || host == "::" ? HostPort{machine_name(), port} : *this;
}

HostPort parse_host_port(std::string_view text, std::string_view key) {
  const auto colon = std::min(text.rfind(':'), text.size());
  std::string_view host = text.substr(0, colon);
  const std::string_view digits = text.substr(std::min(colon + 1, text.size()));
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  std::uint16_t port = 0;
  const char* end = digits.data() + digits.size();
  const auto [read, error] = std::from_chars(digits.data(), end, port);
  if (host.empty() || bracketed != (host.find(':') != std::string_view::npos) ||
      error != std::errc() || read != end || port == 0)
    throw InputError(
        fmt::format("{}: \"{}\" is no address; give HOST:PORT, e.g. 127.0.0.1:8080 or [::1]:8080",
                    key, text.substr(0, 120)));
  return {std::string(host), port};
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
