#include "drivers/gige/detail/link.hpp"

#include <arpa/inet.h>
#include <dirent.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace vergence::gige {
namespace {

// Bytes of Ethernet's header (14), checksum (4), preamble (8) and gap (12).
constexpr int kWireOverhead = 38;
// Bytes of the IP, UDP and GVSP headers.
constexpr int kHeaders = 20 + 8 + 8;
constexpr int kExtendedHeaders = 20 + 8 + 20;
// Largest packet in bytes that most switches forward.
constexpr int kMaxBySwitches = 9000;

double packet_count(const LinkLoad& load, int packet_size) noexcept {
  const int data = std::max(1, packet_size - (load.extended_ids ? kExtendedHeaders : kHeaders));
  const auto filled = (load.payload + data - 1) / data;
  // Adds leader and trailer.
  return static_cast<double>(filled + 2);
}

}  // namespace

Interface find_interface(const std::string& address) {
  Interface found;
  in_addr requested{};
  if (::inet_pton(AF_INET, address.c_str(), &requested) != 1) return found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  for (const ifaddrs* i = list; i != nullptr && found.name.empty(); i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in own{};
    std::memcpy(&own, i->ifa_addr, sizeof own);
    if (own.sin_addr.s_addr == requested.s_addr) found.name = i->ifa_name;
  }
  ::freeifaddrs(list);
  if (found.name.empty()) return found;
  ifreq request{};
  std::strncpy(request.ifr_name, found.name.c_str(), IFNAMSIZ - 1);
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd >= 0) {
    if (::ioctl(fd, SIOCGIFMTU, &request) == 0) found.mtu = request.ifr_mtu;
    (void)::close(fd);
  }
  std::ifstream speed("/sys/class/net/" + found.name + "/speed");
  std::int64_t megabits = 0;
  if (speed >> megabits && megabits > 0) found.speed = megabits * 1'000'000;
  return found;
}

int choose_packet_size(int requested, int mtu, std::int64_t min_size, std::int64_t max_size,
                       std::int64_t step) noexcept {
  std::int64_t size = requested > 0 ? requested : std::min(mtu, kMaxBySwitches);
  size = std::min<std::int64_t>({size, max_size, mtu});
  step = std::max<std::int64_t>(step, 1);
  size = min_size + (size - min_size) / step * step;
  return static_cast<int>(std::max(size, min_size));
}

LinkPlan plan_link(const LinkLoad& load, int packet_size, std::int64_t speed,
                   Duration delay) noexcept {
  LinkPlan plan;
  plan.packet_size = packet_size;
  const double on_wire =
      speed > 0 ? static_cast<double>(packet_size + kWireOverhead) * 8 / static_cast<double>(speed)
                : 0;
  plan.delay = delay >= Duration{} ? delay : Duration::seconds(1.1 * (load.cameras - 1) * on_wire);
  plan.transfer =
      Duration::seconds(packet_count(load, packet_size) * (on_wire + plan.delay.to_seconds()));
  plan.share = plan.transfer.to_seconds() * load.rate_hz;
  return plan;
}

double highest_rate(const LinkLoad& load, int packet_size, std::int64_t speed) noexcept {
  const double transfer =
      plan_link(load, packet_size, speed, Duration::nanoseconds(-1)).transfer.to_seconds();
  return transfer > 0 ? kMaxOfPeriod / transfer : 1e9;
}

int find_udp_socket(std::uint16_t port) {
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) return -1;
  int found = -1;
  while (const dirent* entry = ::readdir(folder)) {
    const int fd = static_cast<int>(std::strtol(entry->d_name, nullptr, 10));
    int type = 0;
    socklen_t length = sizeof type;
    if (fd <= 2 || ::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM)
      continue;
    sockaddr_in own{};
    length = sizeof own;
    if (::getsockname(fd, reinterpret_cast<sockaddr*>(&own), &length) != 0 ||
        own.sin_family != AF_INET || ntohs(own.sin_port) != port)
      continue;
    found = fd;
    break;
  }
  (void)::closedir(folder);
  return found;
}

std::int64_t set_receive_buffer(int socket, std::int64_t bytes) {
  const int requested = static_cast<int>(std::min<std::int64_t>(bytes, INT_MAX / 4));
  // SO_RCVBUFFORCE exceeds the system's limit with CAP_NET_ADMIN; SO_RCVBUF is silently capped.
  if (::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &requested, sizeof requested) != 0)
    (void)::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &requested, sizeof requested);
  int got = 0;
  socklen_t length = sizeof got;
  if (::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &got, &length) != 0) return 0;
  // The kernel doubles the requested size for its own bookkeeping.
  return got / 2;
}

}  // namespace vergence::gige
