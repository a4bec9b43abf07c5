#pragma once
#include <cstdint>

namespace vergence::gige {

/// Load of a link: identical cameras.
struct LinkDemand {
  std::int64_t image_bytes = 0;
  double rate_hz = 0;
  int cameras = 1;
  int mtu = 1500;          // bytes, of the interface
  int packet_size = 0;     // bytes, wished for; 0: what the driver takes
  std::int64_t speed = 0;  // bit/s, > 0
};
struct LinkBudget {
  int packet_size = 0;  // bytes, with the IP, UDP and GVSP headers
  double used = 0;  // of what the link may be used for (90 % of the time between two images): above
                    // 1 it does not fit
  double highest_hz = 0;  // rate at which it just does
};
/// The driver's own plan, without a camera: packets of the interface's size, pauses so that those
/// of several cameras interleave.
///
/// A pure function. Precondition: speed > 0, cameras > 0.
[[nodiscard]] LinkBudget link_budget(const LinkDemand& demand) noexcept;

}  // namespace vergence::gige
