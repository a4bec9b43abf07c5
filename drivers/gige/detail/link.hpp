#pragma once
#include <cstdint>
#include <string>

#include "core/types/time.hpp"

namespace vergence::gige {

/// Network interface that leads to a camera.
struct Interface {
  std::string name;
  /// MTU in bytes.
  int mtu = 1500;
  /// Speed in bit/s; 0 if the system does not report it (loopback, virtual).
  std::int64_t speed = 0;
};
/// Interface with this IPv4 address; its name is empty if there is none.
[[nodiscard]] Interface find_interface(const std::string& address);

/// Requirements of a stream on its link.
struct LinkLoad {
  /// Bytes per frame.
  std::int64_t payload = 0;
  double rate_hz = 0;
  /// Number of identical cameras that share the link.
  int cameras = 1;
  bool extended_ids = false;
};
struct LinkPlan {
  /// Packet size in bytes (GevSCPSPacketSize), including the IP, UDP and GVSP headers.
  int packet_size = 1500;
  /// Delay between two packets of one camera.
  Duration delay{};
  /// Transfer time of a frame.
  Duration transfer{};
  /// Share of the frame interval that the transfer takes. Above kMaxOfPeriod it does not fit.
  double share = 0;
};
/// Highest permitted share; the rest is reserved for resent packets and control.
inline constexpr double kMaxOfPeriod = 0.9;

/// Largest packet size that interface, camera and request allow, a multiple of the camera's step.
/// If `requested` is 0, at most 9000, the limit of most switches.
[[nodiscard]] int choose_packet_size(int requested, int mtu, std::int64_t min_size,
                                     std::int64_t max_size, std::int64_t step) noexcept;

/// Computes delay and transfer time for a packet size. The delay between two packets is (N − 1) ·
/// (size + 38) · 8 / R plus 10 %, so that the packets of N cameras exposing simultaneously
/// interleave on a link of R bit/s. The 38 bytes are Ethernet's header, checksum, preamble and gap.
/// With `speed` 0 both results are 0. A non-negative `delay` replaces the computed one.
[[nodiscard]] LinkPlan plan_link(const LinkLoad& load, int packet_size, std::int64_t speed,
                                 Duration delay) noexcept;

/// Highest frame rate of such a stream, in Hz.
[[nodiscard]] double highest_rate(const LinkLoad& load, int packet_size,
                                  std::int64_t speed) noexcept;

/// UDP socket of this process that is bound to the port, or −1. The caller does not own the
/// descriptor.
[[nodiscard]] int find_udp_socket(std::uint16_t port);

/// Requests a receive buffer of this size, beyond net.core.rmem_max if the process may. Returns the
/// resulting size in bytes.
[[nodiscard]] std::int64_t set_receive_buffer(int socket, std::int64_t bytes);

}  // namespace vergence::gige
