#include "drivers/sync/time_numbering.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace vergence {
namespace {

// Period of the IEEE 1394 cycle timer, in ns.
constexpr std::int64_t kBusWrap = 128'000'000'000;

/// Sets whose times are on the current clock: those that are open, and the last output one unless a
/// flush has ended its count.
class Counted {
 public:
  explicit Counted(const OpenSets& sets) noexcept
      : out_(sets.any_out() && sets.last_out() >= sets.flushed_below()) {
    if (out_) add(sets.last_out(), sets.last_time());
    for (const OpenSet& o : sets.slots())
      if (o.used && o.set.number >= sets.flushed_below())
        add(o.set.number, o.images[o.base()].time);
  }

  [[nodiscard]] bool any() const noexcept { return any_; }
  /// True if the last output set is one of them.
  [[nodiscard]] bool out() const noexcept { return out_; }
  // Precondition: any().
  [[nodiscard]] std::uint64_t newest() const noexcept { return newest_; }
  [[nodiscard]] std::int64_t newest_time() const noexcept { return newest_time_; }

  [[nodiscard]] bool astray(std::int64_t time, Duration interval) const noexcept {
    // In ns; no frame is that late.
    constexpr double kFarBack = 2e9;
    // In intervals: more than an hour without frames, or the clock was set.
    constexpr double kLeap = 100'000;
    // Stamps of two clocks may be too far apart for integers.
    const auto from = [time](std::int64_t reference) {
      return static_cast<double>(time) - static_cast<double>(reference);
    };
    return any_ && (from(oldest_time_) < -kFarBack ||
                    from(newest_time_) > kLeap * static_cast<double>(interval.ns()));
  }

 private:
  void add(std::uint64_t number, std::int64_t time) noexcept {
    if (!any_ || number >= newest_) {
      newest_ = number;
      newest_time_ = time;
    }
    oldest_time_ = any_ ? std::min(oldest_time_, time) : time;
    any_ = true;
  }

  bool any_ = false, out_;
  std::uint64_t newest_ = 0;
  std::int64_t newest_time_ = 0, oldest_time_ = 0;
};

}  // namespace

std::int64_t TimeNumbering::time_of(const SyncFrame& frame, const OpenSets& sets) const noexcept {
  if (mode_ == SyncMode::approximate_time) return frame.middle.host.ns();
  const std::int64_t own = (frame.exposure_start + frame.exposure / 2).ns();
  if (mode_ != SyncMode::ieee1394_cycle_time || !(sets.any_out() || !sets.empty())) return own;
  std::int64_t reference = sets.last_time();
  for (const OpenSet& o : sets.slots())
    if (o.used) reference = o.images[o.base()].time;
  const std::int64_t apart = (own - reference) % kBusWrap;
  return reference + (apart > kBusWrap / 2    ? apart - kBusWrap
                      : apart < -kBusWrap / 2 ? apart + kBusWrap
                                              : apart);
}

TimeNumbering::Number TimeNumbering::number_of(std::size_t camera, std::int64_t time,
                                               OpenSets* sets) noexcept {
  if (!Counted(*sets).astray(time, interval_)) {
    astray_[camera] = astray_in_a_row_ = 0;
    return {place(time, *sets), false};
  }
  ++astray_[camera];
  if (++astray_in_a_row_ < kMinConsistent) return {};
  astray_ = {};
  astray_in_a_row_ = 0;
  sets->flush();
  return {sets->flushed_below(), true};
}

std::optional<std::uint64_t> TimeNumbering::place(std::int64_t time,
                                                  const OpenSets& sets) const noexcept {
  const OpenSet* best = nullptr;
  std::int64_t nearest = tolerance_.ns();
  for (const OpenSet& o : sets.slots()) {
    if (!o.used || o.set.number < sets.flushed_below()) continue;
    const std::int64_t distance = std::abs(time - o.images[o.base()].time);
    if (distance > nearest) continue;
    nearest = distance;
    best = &o;
  }
  if (best != nullptr) return best->set.number;
  const Counted counted(sets);
  if (!counted.any()) return sets.first_free();
  if (counted.out() && time - sets.last_time() <= tolerance_.ns()) return sets.last_out();
  const std::int64_t steps = std::llround(static_cast<double>(time - counted.newest_time()) /
                                          static_cast<double>(interval_.ns()));
  const bool after = time > counted.newest_time();
  const std::int64_t number =
      static_cast<std::int64_t>(counted.newest()) +
      (after ? std::max<std::int64_t>(steps, 1) : std::min<std::int64_t>(steps, -1));
  if (number < 0 || sets.find(static_cast<std::uint64_t>(number)) != nullptr) return std::nullopt;
  return static_cast<std::uint64_t>(number);
}

}  // namespace vergence
