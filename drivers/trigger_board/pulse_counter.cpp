#include "drivers/trigger_board/pulse_counter.hpp"

#include <algorithm>

namespace vergence::trigger_board {
namespace {

static_assert(trigger_max_lines == kMaxCameras, "line k is camera k");

/// Unwraps the low 32 bits of a number to the value nearest to `expected`.
std::int64_t steps_from(std::uint64_t expected, std::uint32_t low) noexcept {
  const std::uint32_t d = low - static_cast<std::uint32_t>(expected);
  return d < 0x80000000U ? static_cast<std::int64_t>(d)
                         : static_cast<std::int64_t>(d) - 0x100000000LL;
}

enum class ExposureStatus : std::uint8_t { none, good, invalid };

ExposureStatus to_exposure(const TriggerExposure& reported, PulseExposure* exposure) noexcept {
  // In µs.
  constexpr std::int32_t kLongest = 10'000'000;
  if (reported.start_us == TRIGGER_NOT_SEEN || reported.end_us == TRIGGER_NOT_SEEN)
    return ExposureStatus::none;
  if (reported.start_us < 0 || reported.end_us < reported.start_us || reported.end_us > kLongest)
    return ExposureStatus::invalid;
  *exposure = {true, Duration::microseconds(reported.start_us),
               Duration::microseconds(reported.end_us)};
  return ExposureStatus::good;
}

}  // namespace

void PulseCounter::begin(std::uint32_t boot, std::uint32_t next) noexcept {
  boot_ = boot;
  next_ = next;
  any_ = false;
  tick_ = 0;
  asked_ = 0;
  in_row_ = 0;
}

void PulseCounter::set_intervals(std::uint32_t rate_millihertz, std::uint32_t dither_us) noexcept {
  const std::uint64_t period_us = 1'000'000'000U / std::max(1U, rate_millihertz);
  // Allows 10 % less, because the timer rounds and PPS disciplines its ticks.
  shortest_us_ = std::max<std::uint64_t>(
      1, (period_us - std::min<std::uint64_t>(period_us, dither_us)) * 9 / 10);
}

void PulseCounter::end(std::uint32_t next, std::uint32_t to_come) noexcept {
  const std::int64_t missing = steps_from(next_, next);
  if (missing <= 0) return;
  const std::uint64_t left_out = std::min(asked_, static_cast<std::uint64_t>(missing));
  const std::uint64_t rest = static_cast<std::uint64_t>(missing) - left_out;
  counters_.lost += rest - std::min<std::uint64_t>(rest, to_come);
  next_ += static_cast<std::uint64_t>(missing);
  asked_ = 0;
}

bool PulseCounter::refuse() noexcept {
  ++counters_.refused;
  ++in_row_;
  return false;
}

bool PulseCounter::accept(const TriggerEvent& event, Pulse* pulse) noexcept {
  const std::int64_t missing = steps_from(next_, event.pulse);
  if (missing < 0) return refuse();
  if (event.tick > kMaxTicks || (any_ && event.tick <= tick_)) return refuse();
  // Before the first event, the ticks since the start limit the count.
  if (static_cast<std::uint64_t>(missing) > (event.tick - tick_) / shortest_us_ + 1)
    return refuse();

  const auto gap = static_cast<std::uint64_t>(missing);
  const bool flagged = (event.flags & 1U) != 0;
  // A pause is identified by its flag or, if that event is lost, by a gap that contains the pause
  // and the event.
  const bool over = asked_ > 0 && gap > 0 && (flagged || gap > asked_);
  const std::uint64_t left_out = over ? std::min(asked_, gap) : 0;
  if (over) asked_ = 0;
  // The trigger board was too late for these pulses.
  const bool skipped = (event.flags & 2U) != 0;
  if (!skipped) counters_.lost += gap - left_out;
  ++counters_.pulses;
  in_row_ = 0;

  Pulse p;
  p.number = next_ + gap;
  p.edge = stamp_of_tick(event.tick);
  p.boot = event.boot_id;
  p.resumed = flagged || over;
  for (std::size_t k = 0; k < p.exposure.size(); ++k)
    if (to_exposure(event.exposure[k], &p.exposure[k]) == ExposureStatus::invalid)
      ++counters_.exposures_refused;
  *pulse = p;
  next_ = p.number + 1;
  tick_ = event.tick;
  any_ = true;
  return true;
}

}  // namespace vergence::trigger_board
