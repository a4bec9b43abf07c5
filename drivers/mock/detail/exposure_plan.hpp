#pragma once
#include <cstdint>
#include <mutex>
#include <vector>

#include "drivers/camera.hpp"

namespace vergence::mock {

/// What the pulses of a mock's camera are exposed with: a setting holds from its pulse on, until
/// the next.
///
/// Threads  Any. Memory: grows with changes that no pulse has passed yet. Errors: change() may
///          throw std::bad_alloc, and has changed nothing that any pulse settled.
class ExposurePlan {
 public:
  /// From the first pulse on.
  void reset(const ExposureSetting& setting) {
    const std::lock_guard lock(mutex_);
    changes_ = {{0, setting}};
  }
  /// From this pulse on, whatever was to hold later. What only pulses before `past` were exposed
  /// with is forgotten. Precondition: reset().
  void change(std::uint64_t from, const ExposureSetting& setting, std::uint64_t past) {
    const std::lock_guard lock(mutex_);
    while (changes_.size() > 1 && changes_.back().from >= from) changes_.pop_back();
    while (changes_.size() > 1 && changes_[1].from < past) changes_.erase(changes_.begin());
    changes_.push_back({from, setting});
  }
  /// Precondition: reset(); no change has forgotten this pulse.
  [[nodiscard]] ExposureSetting at(std::uint64_t pulse) const {
    const std::lock_guard lock(mutex_);
    ExposureSetting setting = changes_.front().setting;
    for (const Change& c : changes_)
      if (c.from <= pulse) setting = c.setting;
    return setting;
  }

 private:
  struct Change {
    std::uint64_t from = 0;  // pulse
    ExposureSetting setting{};
  };

  mutable std::mutex mutex_;
  std::vector<Change> changes_;  // by pulse, the first is in force
};

}  // namespace vergence::mock
