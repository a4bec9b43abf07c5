#include "drivers/sync/counter_numbering.hpp"

#include <cmath>

namespace vergence {

CounterNumbering::CounterNumbering(Duration interval, bool align_start) noexcept
    : interval_(interval), align_start_(align_start) {
  for (Camera& camera : cameras_) camera.align = align_start;
}

std::uint64_t CounterNumbering::number_of(std::size_t camera, std::uint64_t counter,
                                          HostStamp middle) noexcept {
  // In pulses: more than an hour without frames; a counter that leaps further is broken.
  constexpr std::uint64_t kLeap = 100'000;
  Camera& own = cameras_[camera];
  // Wraps if the base is negative.
  const auto counted = static_cast<std::uint64_t>(own.base) + counter;
  if (timed_ && counted > timed_number_ + kLeap) own.align = true;
  if (own.align) {
    own.align = false;
    if (timed_) {
      const double pulses = (middle - timed_middle_).to_seconds() / interval_.to_seconds();
      own.base = static_cast<std::int64_t>(timed_number_) + std::llround(pulses) -
                 static_cast<std::int64_t>(counter);
    } else {
      own.base = 0;
    }
  }
  const std::int64_t number = own.base + static_cast<std::int64_t>(counter);
  return number < 0 ? 0 : static_cast<std::uint64_t>(number);
}

std::optional<std::uint64_t> CounterNumbering::number_of_lost(
    std::size_t camera, std::uint64_t counter) const noexcept {
  const Camera& own = cameras_[camera];
  const std::int64_t number = own.base + static_cast<std::int64_t>(counter);
  if (own.align || number < 0) return std::nullopt;
  return static_cast<std::uint64_t>(number);
}

void CounterNumbering::record(std::uint64_t number, HostStamp middle, bool leads) noexcept {
  if (!leads && timed_) return;
  timed_ = true;
  timed_number_ = number;
  timed_middle_ = middle;
}

bool CounterNumbering::count_agreement(bool agree) noexcept {
  if (agree) {
    unproven_run_ = 0;
    return false;
  }
  if (!align_start_ || ++unproven_run_ < kAmbiguous) return false;
  unproven_run_ = 0;
  // Aligns to camera 0, whose numbers continue.
  for (std::size_t k = 1; k < cameras_.size(); ++k) cameras_[k].align = true;
  return true;
}

}  // namespace vergence
