#include "app/publish/address.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <memory>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kLongestHost = 253;  // a name of the domain name system
constexpr std::size_t kMostAddresses = 8;  // lines that a person reads

bool host_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '-' || c == '_';
}

bool address_letter(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F') || c == ':' ||
         c == '.';
}

/// Whether a person can type it: one of the link alone wants the name of an interface behind it.
bool typed(const ifaddrs& interface, bool v6_too) {
  if (interface.ifa_addr == nullptr || (interface.ifa_flags & IFF_UP) == 0 ||
      (interface.ifa_flags & IFF_LOOPBACK) != 0)
    return false;
  if (interface.ifa_addr->sa_family == AF_INET) return true;
  if (interface.ifa_addr->sa_family != AF_INET6 || !v6_too) return false;
  const auto* v6 = reinterpret_cast<const sockaddr_in6*>(interface.ifa_addr);
  return !IN6_IS_ADDR_LINKLOCAL(&v6->sin6_addr);
}

std::string digits_of(const sockaddr& address) {
  std::array<char, NI_MAXHOST> text{};
  const socklen_t size = address.sa_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
  const int error =
      ::getnameinfo(&address, size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST);
  return error == 0 ? text.data() : "";
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

std::vector<HostPort> addresses_of(const HostPort& address) {
  const bool every_v6 = address.host == "::";
  if (address.host != "0.0.0.0" && !every_v6) return {address};
  std::vector<HostPort> out;
  ifaddrs* found = nullptr;
  if (::getifaddrs(&found) == 0) {
    const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(found, ::freeifaddrs);
    for (const ifaddrs* i = found; i != nullptr && out.size() < kMostAddresses; i = i->ifa_next)
      if (typed(*i, every_v6))
        if (const std::string host = digits_of(*i->ifa_addr); !host.empty())
          out.push_back({host, address.port});
  }
  if (out.empty()) out.push_back({every_v6 ? "::1" : "127.0.0.1", address.port});
  return out;
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
