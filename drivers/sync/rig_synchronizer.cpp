#include "drivers/sync/rig_synchronizer.hpp"

#include <algorithm>
#include <cassert>
#include <cstdlib>

#include "drivers/sync/durations.hpp"

namespace vergence {

RigSynchronizer::RigSynchronizer(const SyncOptions& options) noexcept
    : options_(options),
      by_counter_(options.interval, options.align_start && options.mode == SyncMode::frame_counter),
      by_time_(options),
      train_(options.interval),
      master_(options.interval) {
  assert(options.validate() == nullptr);
  const std::uint64_t pause = options.mode == SyncMode::master_strobe ? 0 : kPause;
  for (std::size_t k = 0; k < matchers_.size(); ++k)
    matchers_[k] = PulseMatcher(noise_of(k), options.interval, options.camera[k].latest, pause);
}

SyncResult RigSynchronizer::offer(const SyncFrame& frame) noexcept {
  assert(frame.camera >= 0 && frame.camera < options_.cameras && !sets_.crowded());
  const auto k = static_cast<std::size_t>(frame.camera);
  now_ = std::max(now_, frame.arrival);
  SetImage image{frame.middle, 0, {}, {}, frame.exposure};
  std::uint64_t number = 0;
  const Step step = number_of(frame, &number, &image);
  if (step == Step::acquiring) return SyncResult::acquiring;
  if (step == Step::late) {
    ++counters_.late[k];
    return SyncResult::late;
  }
  if (sets_.is_out(number)) return verdict_on_late(k, number, step, image);
  OpenSet* open = sets_.find(number);
  if (step == Step::again || (open != nullptr && open->set.present[k])) {
    ++counters_.duplicate[k];
    return SyncResult::duplicate;
  }
  if (open == nullptr) open = &sets_.open(number, frame.arrival);
  open->set.present[k] = true;
  open->set.slots[k] = frame.slot;
  open->set.arrivals[k] = frame.arrival;
  open->set.arrival = std::max(open->set.arrival, frame.arrival);
  open->images[k] = image;
  Source& source = sources_[k];
  source.here = true;
  source.newest = source.any ? std::max(source.newest, number) : number;
  source.any = true;
  by_counter_.record(number, frame.middle.host, k == 0 || !sources_[0].here);
  return SyncResult::accepted;
}

/// Result for a frame whose set was output with its image, without it, or before it was verified.
SyncResult RigSynchronizer::verdict_on_late(std::size_t camera, std::uint64_t number, Step step,
                                            const SetImage& image) noexcept {
  if (number < sources_[camera].from) {
    ++counters_.acquiring[camera];
    return SyncResult::acquiring;
  }
  const bool of_it = !pairs_by_time(options_.mode) ||
                     std::abs(image.time - sets_.last_time()) <= options_.tolerance.ns();
  const bool given = step == Step::again || (of_it && sets_.went_out_with(number, camera));
  ++(given ? counters_.duplicate : counters_.late)[camera];
  return given ? SyncResult::duplicate : SyncResult::late;
}

bool RigSynchronizer::waited_for(std::size_t camera) const noexcept {
  return sources_[camera].here && verified(static_cast<int>(camera));
}

bool RigSynchronizer::ready(const OpenSet& open) const noexcept {
  const std::uint64_t number = open.set.number;
  if (finishing_ || sets_.crowded() || now_ - open.first >= options_.hold ||
      number < sets_.flushed_below())
    return true;
  if (verifies_numbers(options_.mode) && (train_.size() == 0 || train_.newest().number < number))
    return false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    const Source& s = sources_[k];
    if (open.set.present[k] && open.images[k].suspect && matchers_[k].suspect()) return false;
    const bool passed = s.any && !by_counter_.aligning(k) && s.newest > number;
    if (waited_for(k) && !open.set.present[k] && !passed) return false;
  }
  return true;
}

bool RigSynchronizer::next(SyncedSet* set) noexcept {
  OpenSet* open = sets_.oldest();
  if (open == nullptr || !ready(*open)) return false;
  emit(open, set);
  return true;
}

/// Middle of camera 0, or of the first present camera.
void RigSynchronizer::stamp(const OpenSet& open, SyncedSet* set) const noexcept {
  const std::size_t base = open.base();
  set->stamp = open.images[base].middle.host;
  set->error = open.images[base].middle.error;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k)
    if (set->present[k])
      set->spread = std::max(set->spread, magnitude(open.images[k].middle.host - set->stamp));
}

/// Maps the pulse's edge to the host's clock and adds the middles of the exposures, as measured by
/// feedback or as configured.
void RigSynchronizer::stamp_by_pulse(const OpenSet& open, SyncedSet* set) const noexcept {
  const PulseTrain::Entry* pulse = train_.find(set->number);
  const std::size_t base = open.base();
  set->reported = pulse != nullptr;
  MappedStamp edge{};
  if (pulse != nullptr) {
    edge = {pulse->host, pulse->host_error};
  } else {
    edge = train_.to_host(open.images[base].edge);
    edge.error = edge.error + open.images[base].gate;
  }
  const auto middle = [&](std::size_t k) {
    const bool fed_back = pulse != nullptr && pulse->exposure[k].seen;
    return fed_back ? (pulse->exposure[k].start + pulse->exposure[k].end) / 2
                    : options_.camera[k].delay + open.images[k].exposure / 2;
  };
  set->stamp = edge.host + middle(base);
  set->error = edge.error;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k)
    if (set->present[k]) set->spread = std::max(set->spread, magnitude(middle(k) - middle(base)));
}

void RigSynchronizer::emit(OpenSet* open, SyncedSet* set) noexcept {
  *set = open->set;
  const bool numbered = verifies_numbers(options_.mode);
  // Pulses of an ended train are unknown; their cameras' own stamps are used.
  const bool of_train = numbered && train_.size() > 0 && set->number >= sets_.flushed_below();
  if (of_train) {
    stamp_by_pulse(*open, set);
  } else {
    stamp(*open, set);
  }
  counters_.unreported += numbered && !set->reported ? 1 : 0;
  set->complete = true;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    if (set->present[k]) continue;
    set->complete = false;
    if (!sources_[k].here) {
      ++counters_.absent[k];
    } else if (!numbered) {
      ++counters_.lost[k];
    }
  }
  prove(open, set);
  ++(set->complete ? counters_.complete : counters_.incomplete);
  if (!set->complete && sets_.crowded()) ++counters_.pushed_out;
  const bool any_out = sets_.any_out();
  const std::uint64_t last_out = sets_.last_out();
  if (numbered) {
    counters_.missed +=
        any_out && last_out >= steady_from_ ? train_.between(last_out, set->number) : 0;
  } else {
    counters_.missed += any_out ? set->number - last_out - 1 : set->number;
  }
  sets_.close(open);
}

/// Evaluates the evidence of a set, and whether pulses must be associated again.
void RigSynchronizer::prove(OpenSet* open, SyncedSet* set) noexcept {
  switch (options_.mode) {
    case SyncMode::approximate_time:
      set->proof = SyncProof::by_time;
      return;
    case SyncMode::side_by_side:
      set->proof = SyncProof::common_clock;
      return;
    case SyncMode::ieee1394_cycle_time:
    case SyncMode::ptp:
      // If the clock is no longer common (no PTP master, or two), it pairs one exposure with the
      // next after drifting by an interval; the host's stamps reveal this.
      set->proof = SyncProof::common_clock;
      if (!host_stamps_agree(*set) || a_clock_is_apart()) mark_ambiguous(set);
      return;
    case SyncMode::board:
    case SyncMode::ins_syncout:
    case SyncMode::master_strobe:
      for (std::size_t k = 0; k < matchers_.size(); ++k)
        open->contradicted = open->contradicted ||
                             (set->present[k] && open->images[k].suspect && matchers_[k].suspect());
      set->proof =
          options_.mode == SyncMode::master_strobe ? SyncProof::master : SyncProof::numbered;
      if (open->contradicted) mark_ambiguous(set);
      return;
    case SyncMode::frame_counter:
      break;
  }
  if (std::count(set->present.begin(), set->present.end(), true) < 2) return;
  const bool agree = host_stamps_agree(*set);
  if (!agree) mark_ambiguous(set);
  if (by_counter_.count_agreement(agree)) ++counters_.realigned;
}

/// True also for a single image, which has no spread.
bool RigSynchronizer::host_stamps_agree(const SyncedSet& set) const noexcept {
  return set.spread * 2 <= options_.interval;
}

bool RigSynchronizer::a_clock_is_apart() const noexcept {
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k)
    if (sources_[k].here && by_time_.apart(k)) return true;
  return false;
}

void RigSynchronizer::mark_ambiguous(SyncedSet* set) noexcept {
  set->proof = SyncProof::ambiguous;
  ++counters_.ambiguous;
}

SyncCounters RigSynchronizer::counters() const noexcept {
  SyncCounters c = counters_;
  for (std::size_t k = 0; k < matchers_.size(); ++k) {
    c.acquisitions[k] = matchers_[k].acquisitions();
    c.worst_acquisition = std::max(c.worst_acquisition, matchers_[k].worst_acquisition());
  }
  return c;
}

void RigSynchronizer::lost(int camera, std::uint64_t counter) noexcept {
  const auto k = static_cast<std::size_t>(camera);
  Source& source = sources_[k];
  // First number that is still waited for.
  std::uint64_t next = 0;
  if (options_.mode == SyncMode::frame_counter) {
    const auto number = by_counter_.number_of_lost(k, counter);
    if (!number) return;
    next = *number + 1;
  } else if (verifies_numbers(options_.mode) && matchers_[k].verified()) {
    next = matchers_[k].min_number(counter) + 1;
  } else {
    return;
  }
  source.newest = source.any ? std::max(source.newest, next) : next;
  source.any = true;
}

void RigSynchronizer::absent(int camera) noexcept {
  sources_[static_cast<std::size_t>(camera)].here = false;
}

void RigSynchronizer::restarted(int camera) noexcept {
  const auto k = static_cast<std::size_t>(camera);
  Source& source = sources_[k];
  source.here = true;
  source.any = false;
  if (options_.mode == SyncMode::frame_counter) by_counter_.align(k);
  sets_.contradict_suspect(k);
  matchers_[k].restart();
  if (k == 0) master_.restart();
}

}  // namespace vergence
