#include "drivers/sync/rig_synchronizer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace vergence {

RigSynchronizer::RigSynchronizer(const SyncOptions& options) noexcept : options_(options) {
  assert(options.validate() == nullptr);
  for (Source& s : sources_) s.align = options.align_start;
}

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

/// The number of the open set that it fits into, or a new one in the order of time; a number that is out already: too late.
std::uint64_t RigSynchronizer::number_by_time(const SyncFrame& frame) noexcept {
  const HostStamp middle = frame.middle.host;
  const Open *best = nullptr, *newest = nullptr;
  Duration nearest = options_.tolerance;
  for (const Open& o : open_) {
    if (!o.used) continue;
    if (newest == nullptr || o.set.number > newest->set.number) newest = &o;
    std::size_t first = 0;
    while (!o.set.present[first]) ++first;
    const Duration apart = middle - o.middles[first].host, distance = apart < Duration{} ? -apart : apart;
    if (distance > nearest) continue;
    nearest = distance;
    best = &o;
  }
  if (best != nullptr) return best->set.number;
  if (any_out_ && middle - last_middle_ <= options_.tolerance) return last_out_;
  if (newest == nullptr && !any_out_) return 0;
  std::uint64_t reference = last_out_;
  HostStamp reference_middle = last_middle_;
  if (newest != nullptr) {
    std::size_t first = 0;
    while (!newest->set.present[first]) ++first;
    reference = newest->set.number;
    reference_middle = newest->middles[first].host;
  }
  const std::int64_t steps = std::llround((middle - reference_middle).to_seconds() / options_.interval.to_seconds());
  const bool after = middle > reference_middle;
  const std::int64_t number =
      static_cast<std::int64_t>(reference) + (after ? std::max<std::int64_t>(steps, 1) : std::min<std::int64_t>(steps, -1));
  const bool taken = number < 0 || find(static_cast<std::uint64_t>(number)) != nullptr;
  return taken ? last_out_ : static_cast<std::uint64_t>(number);
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
  const bool by_time = options_.mode == SyncMode::software;
  const std::uint64_t number = by_time ? number_by_time(frame) : number_of(frame);
  if (any_out_ && number <= last_out_) {
    const Gone& g = history_[number % kHistory];
    const bool of_it = !by_time || frame.middle.host - last_middle_ >= -options_.tolerance;
    const bool given = of_it && g.used && g.number == number && g.present[k];
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
  prove(set);
  ++(set->complete ? counters_.complete : counters_.incomplete);
  if (!set->complete && open_count_ > kOpen) ++counters_.pushed_out;
  counters_.missed += any_out_ ? set->number - last_out_ - 1 : set->number;
  history_[set->number % kHistory] = {set->number, set->present, true};
  any_out_ = true;
  last_out_ = set->number;
  last_middle_ = set->stamp;
  open->used = false;
  --open_count_;
}

/// What can be said of a set's togetherness, and whether the pulses have to be found anew.
void RigSynchronizer::prove(SyncedSet* set) noexcept {
  if (options_.mode == SyncMode::software) {
    set->proof = SyncProof::by_time;
    return;
  }
  const bool several = std::count(set->present.begin(), set->present.end(), true) > 1;
  if (!several) return;
  if (set->spread * 2 <= options_.interval) {
    unproven_run_ = 0;
    return;
  }
  set->proof = SyncProof::unproven;
  ++counters_.unproven;
  if (!options_.align_start || ++unproven_run_ < kUnproven) return;
  unproven_run_ = 0;
  ++counters_.realigned;
  for (std::size_t k = 1; k < sources_.size(); ++k) sources_[k].align = true;  // to camera 0, whose numbers go on
}

void RigSynchronizer::lost(int camera, std::uint64_t counter) noexcept {
  Source& source = sources_[static_cast<std::size_t>(camera)];
  if (options_.mode != SyncMode::counter || source.align) return;
  const std::int64_t number = source.base + static_cast<std::int64_t>(counter);
  if (number < 0) return;
  const auto next = static_cast<std::uint64_t>(number) + 1;  // the first that is still waited for
  source.newest = source.any ? std::max(source.newest, next) : next;
  source.any = true;
}

void RigSynchronizer::pulse(const Pulse&) noexcept {}

std::uint32_t RigSynchronizer::wants_pause() noexcept { return 0; }

bool RigSynchronizer::proven(int) const noexcept { return !proves_numbers(options_.mode); }

void RigSynchronizer::absent(int camera) noexcept { sources_[static_cast<std::size_t>(camera)].here = false; }

void RigSynchronizer::restarted(int camera) noexcept {
  Source& source = sources_[static_cast<std::size_t>(camera)];
  source.here = true;
  source.any = false;
  source.align = true;
}

}  // namespace vergence
