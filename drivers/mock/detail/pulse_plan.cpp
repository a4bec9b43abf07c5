#include "drivers/mock/detail/pulse_plan.hpp"

#include <algorithm>

#include "firmware_iface/trigger/trigger.h"

namespace vergence::mock {
namespace {

bool stops_the_board(const Fault& f) noexcept {
  return f.kind == FaultKind::board_reboot ||
         (f.kind == FaultKind::board_disconnected && !f.powered);
}

/// When the board runs again if it does not at that time, else that time; the largest Duration:
/// never.
Duration running_from(const std::vector<Fault>& faults, Duration time) noexcept {
  for (bool again = true; again;) {
    again = false;
    for (const Fault& f : faults) {
      if (!stops_the_board(f) || !f.active(time)) continue;
      if (f.duration <= Duration{}) return Duration::nanoseconds(INT64_MAX);
      time = f.at + f.duration;
      again = true;
    }
  }
  return time;
}

bool down_by(const std::vector<Fault>& faults, Duration time) noexcept {
  return std::any_of(faults.begin(), faults.end(), [&](const Fault& f) {
    return f.kind == FaultKind::board_disconnected && f.active(time);
  });
}

}  // namespace

PulsePlan::PulsePlan(const TriggerConfiguration& c, Duration length,
                     const std::vector<Fault>& faults)
    : period_(Duration::seconds(1 / c.rate_hz)), boots_{Duration{}} {
  // Intervals since the boot's first pulse, and how much longer they were than even ones.
  std::uint64_t in_boot = 0;
  Duration first{}, longer{};
  for (;;) {
    // From the boot's first pulse: an even train has no sum of rounded intervals.
    const Duration time =
        first + Duration::seconds(static_cast<double>(in_boot) / c.rate_hz) + longer;
    if (time > length) break;
    const Duration running = running_from(faults, time);
    if (running > time) {
      if (running > length) break;
      first = running;
      longer = {};
      in_boot = 0;
      boots_.push_back(first);
      continue;
    }
    slots_.push_back({time, in_boot, static_cast<std::uint32_t>(boots_.size() - 1)});
    if (c.vary > Duration{})
      longer = longer +
               (trigger_interval_is_longer(static_cast<std::uint32_t>(in_boot)) ? c.vary : -c.vary);
    ++in_boot;
  }
  std::vector<Duration> edges;
  for (const Fault& f : faults) {
    if (f.kind != FaultKind::board_disconnected) continue;
    edges.push_back(f.at);
    if (f.duration > Duration{}) edges.push_back(f.at + f.duration);
  }
  std::sort(edges.begin(), edges.end());
  for (const Duration edge : edges) {
    const bool disconnected = down_by(faults, edge),
               was = !link_.empty() && link_.back().disconnected;
    if (disconnected != was) link_.push_back({edge, disconnected});
  }
}

PulsePlan::Slot PulsePlan::at(std::uint64_t i) const noexcept {
  if (i < slots_.size()) return slots_[static_cast<std::size_t>(i)];
  if (slots_.empty()) return {period_ * static_cast<std::int64_t>(i), i, 0};
  const std::uint64_t beyond = i - (slots_.size() - 1);
  const Slot& last = slots_.back();
  return {last.time + period_ * static_cast<std::int64_t>(beyond), last.number + beyond, last.boot};
}

std::size_t PulsePlan::first_from(Duration time) const noexcept {
  const auto it = std::lower_bound(slots_.begin(), slots_.end(), time,
                                   [](const Slot& s, Duration t) { return s.time < t; });
  return static_cast<std::size_t>(it - slots_.begin());
}

bool PulsePlan::link_down(Duration time) const noexcept {
  bool down = false;
  for (const LinkEvent& e : link_)
    if (e.time <= time) down = e.disconnected;
  return down;
}

}  // namespace vergence::mock
