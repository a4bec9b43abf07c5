#include "drivers/sync/missed_trigger_doubt.hpp"

#include <algorithm>

namespace vergence {

bool MissedTriggerDoubt::add(std::uint64_t missed) noexcept {
  pulses_ += missed;
  rivals_ = {};
  return pulses_ <= kMost;
}

bool MissedTriggerDoubt::compare(const PulseTrain& train, std::uint64_t number,
                                 Duration limit) noexcept {
  const PulseTrain::Entry* pulse = train.find(number);
  bool all = true;
  for (std::size_t s = 1; s <= pulses_; ++s) {
    Rival& rival = rivals_[s - 1];
    const PulseTrain::Entry* earlier = train.before(number, s);
    if (!rival.refuted && pulse != nullptr && earlier != nullptr) {
      const Duration apart = pulse->edge - earlier->edge;
      rival.least = rival.compared ? std::min(rival.least, apart) : apart;
      rival.greatest = rival.compared ? std::max(rival.greatest, apart) : apart;
      rival.compared = true;
      rival.refuted = rival.greatest - rival.least > limit;
    }
    all = all && rival.refuted;
  }
  if (all) clear();
  return all;
}

}  // namespace vergence
