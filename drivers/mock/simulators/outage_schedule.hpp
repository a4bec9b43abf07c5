#pragma once
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "core/types/time.hpp"

namespace vergence::mock {

/// The line is unplugged for a while.
struct Outage {
  HostStamp from{}, to{};
  bool device_powered = true;  // false: the device is off, too
};

/// Outages one after the other: which has begun, and when the next begins or ends.
///
/// Threads  One caller. Errors: none.
class OutageSchedule {
 public:
  /// In order, none into the next.
  explicit OutageSchedule(std::vector<Outage> outages) : outages_(std::move(outages)) {}

  /// When one begins or ends next; none: it is over with them.
  [[nodiscard]] std::optional<HostStamp> next() const noexcept;
  /// What next() told happens: the outage that begins; or, with in_outage() false afterwards, the
  /// one that ends. Precondition: next().
  const Outage& change() noexcept;
  [[nodiscard]] bool in_outage() const noexcept { return in_outage_; }
  /// By the schedule, whether change() was called or not.
  [[nodiscard]] bool unplugged(HostStamp now) const noexcept {
    return at_ < outages_.size() && now >= outages_[at_].from;
  }
  [[nodiscard]] std::size_t begun() const noexcept { return begun_; }

 private:
  std::vector<Outage> outages_;
  std::size_t at_ = 0;  // the one that has begun or will be next
  bool in_outage_ = false;
  std::size_t begun_ = 0;
};

}  // namespace vergence::mock
