#include "firmware_iface/iidc/cycle_time.hpp"

namespace vergence::iidc {

std::int64_t CycleUnwrapper::unwrap(std::int64_t wrapped_ns, std::int64_t host_ns) noexcept {
  std::int64_t unwrapped = wrapped_ns;
  if (known_) {
    const std::int64_t expected = last_ns_ + (host_ns - last_host_ns_);
    const std::int64_t turns = expected - wrapped_ns + kCycleTimeWrapNs / 2;
    const std::int64_t whole = turns >= 0 ? turns / kCycleTimeWrapNs
                                          : -((-turns + kCycleTimeWrapNs - 1) / kCycleTimeWrapNs);
    unwrapped += whole * kCycleTimeWrapNs;
  }
  known_ = true;
  last_ns_ = unwrapped;
  last_host_ns_ = host_ns;
  return unwrapped;
}

}  // namespace vergence::iidc
