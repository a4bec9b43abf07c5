#include "drivers/sync/rig_synchronizer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace vergence {

const char* SyncOptions::validate() const noexcept {
  if (cameras < 1 || cameras > kMaxCameras) return "a rig has one to four cameras";
  if (interval <= Duration{}) return "the interval between two pulses must be positive";
  if (hold <= Duration{}) return "the time a set waits for its images must be positive";
  return nullptr;
}

RigSynchronizer::RigSynchronizer(const SyncOptions& options) noexcept : options_(options) { assert(options.validate() == nullptr); }

std::uint64_t RigSynchronizer::number_of(const SyncFrame& frame) noexcept {
  constexpr std::uint64_t kLeap = 100'000;  // pulses: over an hour of silence; a counter that leaps further is broken
  Source& source = sources_[static_cast<std::size_t>(frame.camera)];
  const auto counted = static_cast<std::uint64_t>(source.base) + frame.counter;  // wraps where the base is negative
  if (timed_ && counted > timed_number_ + kLeap) source.align = true;
  if (source.align) {
    source.align = false;
    if (timed_) {
      const double pulses = (frame.middle.host - timed_middle_).to_seconds() / options_.interval.to_seconds();
      source.base = static_cast<std::int64_t>(timed_number_) + std::llround(pulses) - static_cast<std::int64_t>(frame.counter);
    } else {
      source.base = 0;
    }
  }
  const std::int64_t number = source.base + static_cast<std::int64_t>(frame.counter);
  return number < 0 ? 0 : static_cast<std::uint64_t>(number);
}

RigSynchronizer::Open* RigSynchronizer::find(std::uint64_t number) noexcept {
  for (Open& o : open_)
    if (o.used && o.set.number == number) return &o;
  return nullptr;
}

RigSynchronizer::Open* RigSynchronizer::oldest() noexcept {
  Open* best = nullptr;
  for (Open& o : open_)
    if (o.used && (best == nullptr || o.set.number < best->set.number)) best = &o;
  return best;
}

SyncVerdict RigSynchronizer::offer(const SyncFrame& frame) noexcept {
  assert(frame.camera >= 0 && frame.camera < options_.cameras && open_count_ <= kOpen);
  const auto k = static_cast<std::size_t>(frame.camera);
  now_ = std::max(now_, frame.arrival);
  const std::uint64_t number = number_of(frame);
  if (any_out_ && number <= last_out_) {
    const Gone& g = history_[number % kHistory];
    const bool given = g.used && g.number == number && g.present[k];
    ++(given ? counters_.duplicate : counters_.late)[k];
    return given ? SyncVerdict::duplicate : SyncVerdict::late;
  }
  Open* open = find(number);
  if (open != nullptr && open->set.present[k]) {
    ++counters_.duplicate[k];
    return SyncVerdict::duplicate;
  }
  if (open == nullptr) {
    open = std::find_if(open_.data(), open_.data() + open_.size(), [](const Open& o) { return !o.used; });
    *open = Open{};
    open->used = true;
    open->set.number = number;
    open->first = frame.arrival;
    ++open_count_;
  }
  open->set.present[k] = true;
  open->set.slots[k] = frame.slot;
  open->set.arrival = std::max(open->set.arrival, frame.arrival);
  open->middles[k] = frame.middle;
  Source& source = sources_[k];
  source.here = true;
  source.newest = source.any ? std::max(source.newest, number) : number;
  source.any = true;
  if (k == 0 || !timed_ || !sources_[0].here) {
    timed_ = true;
    timed_number_ = number;
    timed_middle_ = frame.middle.host;
  }
  return SyncVerdict::taken;
}

bool RigSynchronizer::ready(const Open& open) const noexcept {
  if (finishing_ || open_count_ > kOpen || now_ - open.first >= options_.hold) return true;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    const Source& s = sources_[k];
    const bool passed = s.any && !s.align && s.newest > open.set.number;
    if (s.here && !open.set.present[k] && !passed) return false;
  }
  return true;
}

bool RigSynchronizer::next(SyncedSet* set) noexcept {
  Open* open = oldest();
  if (open == nullptr || !ready(*open)) return false;
  emit(open, set);
  return true;
}

void RigSynchronizer::emit(Open* open, SyncedSet* set) noexcept {
  *set = open->set;
  const auto n = static_cast<std::size_t>(options_.cameras);
  std::size_t base = 0;
  while (!set->present[base]) ++base;
  set->stamp = open->middles[base].host;
  set->error = open->middles[base].error;
  set->complete = true;
  for (std::size_t k = 0; k < n; ++k) {
    if (set->present[k]) {
      const Duration apart = open->middles[k].host - set->stamp;
      set->spread = std::max(set->spread, apart < Duration{} ? -apart : apart);
    } else {
      set->complete = false;
      ++(sources_[k].here ? counters_.lost : counters_.absent)[k];
    }
  }
  ++(set->complete ? counters_.complete : counters_.incomplete);
  if (!set->complete && open_count_ > kOpen) ++counters_.pushed_out;
  counters_.missed += any_out_ ? set->number - last_out_ - 1 : set->number;
  history_[set->number % kHistory] = {set->number, set->present, true};
  any_out_ = true;
  last_out_ = set->number;
  open->used = false;
  --open_count_;
}

void RigSynchronizer::absent(int camera) noexcept { sources_[static_cast<std::size_t>(camera)].here = false; }

void RigSynchronizer::restarted(int camera) noexcept {
  Source& source = sources_[static_cast<std::size_t>(camera)];
  source.here = true;
  source.any = false;
  source.align = true;
}

}  // namespace vergence
