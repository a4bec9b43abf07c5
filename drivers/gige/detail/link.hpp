#pragma once
#include <cstdint>
#include <string>

#include "core/types/time.hpp"

namespace vergence::gige {

/// The network interface that a camera is reached through.
struct Interface {
  std::string name;
  int mtu = 1500;          // bytes
  std::int64_t speed = 0;  // bit/s; 0: the system does not say (loopback, virtual)
};
/// The one with this IPv4 address; without one the name is empty.
[[nodiscard]] Interface find_interface(const std::string& address);

/// Requirements of a stream on its link.
struct LinkLoad {
  std::int64_t payload = 0;  // bytes a frame
  double rate_hz = 0;
  int cameras = 1;  // that share the link, all alike
  bool extended_ids = false;
};
struct LinkPlan {
  int packet_size = 1500;  // bytes, GevSCPSPacketSize: with the IP, UDP and GVSP headers
  Duration delay{};        // between two packets of one camera
  Duration transfer{};     // of a frame
  double share = 0;  // of the time between two frames that the transfer takes; above kMaxOfPeriod
                     // it does not fit
};
inline constexpr double kMaxOfPeriod = 0.9;  // the rest is for resent packets and control

/// The largest packet that interface, camera and request allow, a multiple of the camera's step.
/// `wished` 0: at most 9000, what switches carry.
[[nodiscard]] int choose_packet_size(int wished, int mtu, std::int64_t least, std::int64_t most,
                                     std::int64_t step) noexcept;

/// Delay and transfer time for a packet size: (N − 1) · (size + 38) · 8 / R between two packets, 10
/// % more, so that the packets of N cameras that expose together interleave on a link of R bit/s.
/// 38 bytes are Ethernet's header, check sum, preamble and gap. `speed` 0: no delay, no time.
/// `delay` not negative: that delay instead of the computed one.
[[nodiscard]] LinkPlan plan_link(const LinkLoad& load, int packet_size, std::int64_t speed,
                                 Duration delay) noexcept;

/// Highest rate of such a stream, Hz.
[[nodiscard]] double highest_rate(const LinkLoad& load, int packet_size,
                                  std::int64_t speed) noexcept;

/// The UDP socket of this process that is bound to a port, −1: none. The descriptor stays its
/// owner's.
[[nodiscard]] int find_udp_socket(std::uint16_t port);

/// Asks for a receive buffer of so many bytes, beyond net.core.rmem_max where the process may. →
/// bytes that it then holds
[[nodiscard]] std::int64_t set_receive_buffer(int socket, std::int64_t bytes);

}  // namespace vergence::gige
