#include "drivers/gige/link_budget.hpp"

#include "drivers/gige/detail/link.hpp"

namespace vergence::gige {

LinkBudget link_budget(const LinkDemand& d) noexcept {
  constexpr int kLeastPacket = 576, kMostPacket = 65'000, kStep = 4;  // bytes: what cameras have
  const LinkLoad load{d.image_bytes, d.rate_hz, d.cameras, false};
  LinkBudget budget;
  budget.packet_size = choose_packet_size(d.packet_size, d.mtu, kLeastPacket, kMostPacket, kStep);
  budget.used =
      plan_link(load, budget.packet_size, d.speed, Duration::nanoseconds(-1)).share / kMostOfPeriod;
  budget.highest_hz = highest_rate(load, budget.packet_size, d.speed);
  return budget;
}

}  // namespace vergence::gige
