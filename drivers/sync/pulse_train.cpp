#include "drivers/sync/pulse_train.hpp"

#include <algorithm>

#include "drivers/sync/durations.hpp"

namespace vergence {

PulseTrain::Step PulseTrain::add(const Pulse& pulse, std::uint64_t first_free) noexcept {
  const bool same = count_ > 0 && pulse.boot == boot_;
  std::uint64_t number = base_ + pulse.number, steps = 0;
  bool goes_on = false;
  if (same) {
    const Entry& last = newest();
    if (number <= last.number) {
      const Entry* held = find(number);
      if (held != nullptr && held->edge == pulse.edge) return Step::known;
    } else {
      steps = number - last.number;
      const Duration passed = pulse.edge - last.edge;
      // Dithered intervals differ by at most a quarter; four times the interval means a clock that
      // was set.
      goes_on = steps <= kLeap && passed > Duration{} &&
                (pulse.resumed || passed <= nominal_ * static_cast<std::int64_t>(4 * steps + 4));
    }
  }
  Entry e{number, 0, pulse.edge, pulse.host, pulse.host_error, pulse.resumed, pulse.exposure};
  if (!goes_on) {
    const bool first = count_ == 0, sensible = pulse.number <= kLeap;
    const std::uint64_t least = first ? first_free : std::max(first_free, newest().number + 1);
    base_ = first && least == 0 && sensible ? 0 : least - pulse.number;
    e.number = base_ + pulse.number;
    boot_ = pulse.boot;
    entries_[0] = e;
    first_ = 0;
    count_ = 1;
    return first ? Step::accepted : Step::began;
  }
  e.skipped = newest().skipped + (pulse.resumed ? steps - 1 : 0);
  if (count_ == kHeld) {
    first_ = (first_ + 1) % kHeld;
    --count_;
  }
  entries_[(first_ + count_) % kHeld] = e;
  ++count_;
  return Step::accepted;
}

const PulseTrain::Entry* PulseTrain::find(std::uint64_t number) const noexcept {
  // Searches backwards, because it is mostly one of the last.
  for (std::size_t i = count_; i-- > 0;) {
    const Entry& e = (*this)[i];
    if (e.number == number) return &e;
    if (e.number < number) return nullptr;
  }
  return nullptr;
}

const PulseTrain::Entry* PulseTrain::before(std::uint64_t number,
                                            std::uint64_t pulses) const noexcept {
  for (std::size_t i = count_; i-- > pulses;) {
    const Entry& e = (*this)[i];
    if (e.number > number) continue;
    if (e.number < number) return nullptr;
    const Entry& earlier = (*this)[i - static_cast<std::size_t>(pulses)];
    return least(earlier.number, earlier.skipped, e.number, e.skipped) == pulses ? &earlier
                                                                                 : nullptr;
  }
  return nullptr;
}

Duration PulseTrain::interval() const noexcept {
  constexpr std::size_t kEnough = 16;
  if (count_ < kEnough) return nominal_;
  const Entry &a = (*this)[0], &b = newest();
  // A gap from stop to start is no interval: number and time are then unrelated.
  for (std::size_t i = 1; i < count_; ++i)
    if ((*this)[i].resumed) return nominal_;
  return (b.edge - a.edge) / static_cast<std::int64_t>(b.number - a.number);
}

std::optional<PulseTrain::Place> PulseTrain::unreported(const Entry& before, const Entry* after,
                                                        DeviceStamp edge) const noexcept {
  const std::uint64_t room = after == nullptr ? kAhead : after->number - before.number - 1;
  if (room == 0) return std::nullopt;
  // Pulses before a regular one fill the time evenly.
  const bool spread = after != nullptr && !after->resumed;
  const Duration step =
      spread ? (after->edge - before.edge) / static_cast<std::int64_t>(room + 1) : interval();
  const Duration passed = edge - before.edge;
  const std::int64_t steps = (passed + step / 2).ns() / step.ns();
  if (steps < 1 || static_cast<std::uint64_t>(steps) > room) return std::nullopt;
  if (magnitude(passed - step * steps) * 4 > step) return std::nullopt;
  const bool paused = after != nullptr && after->resumed;
  const std::uint64_t skipped =
      before.skipped + (paused ? static_cast<std::uint64_t>(steps) - 1 : 0);
  return Place{before.number + static_cast<std::uint64_t>(steps), skipped,
               skipped + (paused ? 1 : 0), nullptr, paused};
}

std::optional<PulseTrain::Place> PulseTrain::place(DeviceStamp edge, Duration gate) const noexcept {
  const Entry* after = nullptr;
  for (std::size_t i = count_; i-- > 0;) {
    const Entry& e = (*this)[i];
    if (magnitude(e.edge - edge) <= gate) return Place{e.number, e.skipped, e.skipped, &e, false};
    if (e.edge < edge) return unreported(e, after, edge);
    after = &e;
  }
  return std::nullopt;
}

MappedStamp PulseTrain::to_host(DeviceStamp edge) const noexcept {
  // Equals 1 / 200 ppm.
  constexpr std::int64_t kDrift = 5'000;
  const Entry* nearest = &newest();
  for (std::size_t i = count_; i-- > 0;) {
    const Entry& e = (*this)[i];
    if (magnitude(e.edge - edge) < magnitude(nearest->edge - edge)) nearest = &e;
    if (e.edge < edge) break;
  }
  const Duration apart = edge - nearest->edge;
  return {nearest->host + apart, nearest->host_error + magnitude(apart) / kDrift};
}

std::uint64_t PulseTrain::between(std::uint64_t after, std::uint64_t before) const noexcept {
  std::uint64_t n = 0;
  for (std::size_t i = count_; i-- > 0 && (*this)[i].number > after;)
    n += (*this)[i].number < before ? 1 : 0;
  return n;
}

}  // namespace vergence
