#include "drivers/mock/simulators/outage_schedule.hpp"

namespace vergence::mock {

std::optional<HostStamp> OutageSchedule::next() const noexcept {
  if (at_ == outages_.size()) return std::nullopt;
  return in_outage_ ? outages_[at_].to : outages_[at_].from;
}

const Outage& OutageSchedule::change() noexcept {
  const Outage& outage = outages_[at_];
  in_outage_ = !in_outage_;
  if (in_outage_)
    ++begun_;
  else
    ++at_;
  return outage;
}

}  // namespace vergence::mock
