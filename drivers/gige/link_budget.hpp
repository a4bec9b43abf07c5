#pragma once
#include <cstdint>

namespace vergence::gige {

/// Load on a link from identical cameras.
struct LinkDemand {
  std::int64_t image_bytes = 0;
  double rate_hz = 0;
  int cameras = 1;
  /// MTU of the interface, in bytes.
  int mtu = 1500;
  /// Requested packet size, in bytes; 0 lets the driver choose.
  int packet_size = 0;
  /// Speed of the link, in bit/s; must be positive.
  std::int64_t speed = 0;
};
struct LinkBudget {
  /// Packet size in bytes, including the IP, UDP and GVSP headers.
  int packet_size = 0;
  /// Share of the usable link capacity (90 % of the frame interval). Above 1 it does not fit.
  double used = 0;
  /// Highest frame rate that fits.
  double highest_hz = 0;
};
/// Computes the driver's plan without a camera: packets of the interface's MTU, with delays that
/// interleave the packets of several cameras. Preconditions: speed > 0, cameras > 0.
[[nodiscard]] LinkBudget link_budget(const LinkDemand& demand) noexcept;

}  // namespace vergence::gige
