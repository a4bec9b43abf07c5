#pragma once
#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "drivers/iidc/budget_words.hpp"
#include "drivers/iidc/frame_reader.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"
#include "firmware_iface/iidc/cycle_time.hpp"

namespace vergence::iidc {

/// What the cameras of this program share on each IEEE 1394 bus: bandwidth, and the bus's clock.
///
/// Threads  Any.
class BusLedger {
 public:
  /// Notes what a camera will need; `who` is a name for it.
  void put(const void* who, const std::string& bus, const BusShare& share) {
    const std::lock_guard lock(mutex_);
    entries_[who] = {bus, share};
  }
  void remove(const void* who) noexcept {
    const std::lock_guard lock(mutex_);
    entries_.erase(who);
  }
  /// Empty: all that was put for this bus fits. Else budget_error().
  [[nodiscard]] std::string last_error(const std::string& bus) const {
    const std::lock_guard lock(mutex_);
    std::vector<BusShare> shares;
    for (const auto& [who, entry] : entries_)
      if (entry.first == bus) shares.push_back(entry.second);
    return budget_error(shares);
  }
  /// The clock of a bus, the same for all its cameras.
  [[nodiscard]] std::shared_ptr<SharedClock> clock(const std::string& bus) {
    const std::lock_guard lock(mutex_);
    auto& clock = clocks_[bus];
    if (clock == nullptr) clock = std::make_shared<Clock>();
    return clock;
  }

 private:
  class Clock final : public SharedClock {
   public:
    std::int64_t unwrap(std::int64_t wrapped_ns, HostStamp at) noexcept override {
      const std::lock_guard lock(mutex_);
      return unwrapper_.unwrap(wrapped_ns, at.ns());
    }

   private:
    std::mutex mutex_;  // the streams of a bus, for nanoseconds each
    CycleUnwrapper unwrapper_;
  };

  mutable std::mutex mutex_;
  std::map<const void*, std::pair<std::string, BusShare>> entries_;
  std::map<std::string, std::shared_ptr<SharedClock>> clocks_;
};

}  // namespace vergence::iidc
