#include "drivers/sync/time_numbering.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace vergence {
namespace {

constexpr std::int64_t kBusWrap = 128'000'000'000;  // ns, of the IEEE 1394 cycle timer

}  // namespace

std::int64_t TimeNumbering::time_of(const SyncFrame& frame, const OpenSets& sets) const noexcept {
  if (mode_ == SyncMode::software) return frame.middle.host.ns();
  const std::int64_t own = (frame.exposure_start + frame.exposure / 2).ns();
  if (mode_ != SyncMode::bus || !(sets.any_out() || !sets.empty())) return own;
  std::int64_t reference = sets.last_time();
  for (const OpenSet& o : sets.slots())
    if (o.used) reference = o.images[o.base()].time;
  const std::int64_t apart = (own - reference) % kBusWrap;
  return reference + (apart > kBusWrap / 2    ? apart - kBusWrap
                      : apart < -kBusWrap / 2 ? apart + kBusWrap
                                              : apart);
}

/// A common clock that has been set back would make everything late for ever.
bool TimeNumbering::ran_back(std::int64_t time, const OpenSets& sets) noexcept {
  constexpr int kBelieved = 3;
  constexpr std::int64_t kFarBack = 2'000'000'000;  // ns: no frame is late by that
  back_ = sets.any_out() && sets.last_time() - time > kFarBack ? back_ + 1 : 0;
  if (back_ < kBelieved) return false;
  back_ = 0;
  return true;
}

TimeNumbering::Number TimeNumbering::number_of(std::int64_t time, OpenSets* sets) noexcept {
  Number n;
  n.clock_set_back = ran_back(time, *sets);
  if (n.clock_set_back) {
    sets->flush();
    new_clock_ = true;
  }
  n.number = place(time, *sets);
  return n;
}

std::uint64_t TimeNumbering::place(std::int64_t time, const OpenSets& sets) noexcept {
  const OpenSet *best = nullptr, *newest = nullptr;
  std::int64_t nearest = tolerance_.ns();
  for (const OpenSet& o : sets.slots()) {
    if (!o.used || o.set.number < sets.flushed_below()) continue;
    if (newest == nullptr || o.set.number > newest->set.number) newest = &o;
    const std::int64_t distance = std::abs(time - o.images[o.base()].time);
    if (distance > nearest) continue;
    nearest = distance;
    best = &o;
  }
  if (best != nullptr) return best->set.number;
  if (new_clock_) {
    new_clock_ = false;
    return sets.flushed_below();
  }
  if (sets.any_out() && sets.last_out() >= sets.flushed_below() &&
      time - sets.last_time() <= tolerance_.ns())
    return sets.last_out();
  if (newest == nullptr && !sets.any_out()) return 0;
  const std::uint64_t reference = newest != nullptr ? newest->set.number : sets.last_out();
  const std::int64_t reference_time =
      newest != nullptr ? newest->images[newest->base()].time : sets.last_time();
  const std::int64_t steps = std::llround(static_cast<double>(time - reference_time) /
                                          static_cast<double>(interval_.ns()));
  const bool after = time > reference_time;
  const std::int64_t number =
      static_cast<std::int64_t>(reference) +
      (after ? std::max<std::int64_t>(steps, 1) : std::min<std::int64_t>(steps, -1));
  const bool taken = number < 0 || sets.find(static_cast<std::uint64_t>(number)) != nullptr;
  return taken ? sets.last_out() : static_cast<std::uint64_t>(number);
}

}  // namespace vergence
