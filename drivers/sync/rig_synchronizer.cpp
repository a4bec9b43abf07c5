#include "drivers/sync/rig_synchronizer.hpp"

#include <algorithm>
#include <cassert>

#include "drivers/sync/durations.hpp"

namespace vergence {

RigSynchronizer::RigSynchronizer(const SyncOptions& options) noexcept
    : options_(options), train_(options.interval) {
  assert(options.validate() == nullptr);
  for (Source& s : sources_) s.align = options.align_start && options.mode == SyncMode::counter;
  const std::uint64_t pause = options.mode == SyncMode::master_strobe ? 0 : kPause;
  for (std::size_t k = 0; k < matchers_.size(); ++k)
    matchers_[k] = PulseMatcher(noise_of(k), options.interval, options.camera[k].latest, pause);
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
  const bool by_time = pairs_by_time(options_.mode);
  Image image{frame.middle, 0, {}, {}, frame.exposure};
  std::uint64_t number = 0;
  Step step = Step::numbered;
  if (by_time) {
    image.time = pairing_time(frame);
    number = number_by_time(frame, image.time);
  } else if (proves_numbers(options_.mode)) {
    step = number_by_pulse(frame, &number, &image);
  } else {
    number = number_of(frame);
  }
  if (step == Step::acquiring) return SyncVerdict::acquiring;
  if (any_out_ && number <= last_out_ && number < sources_[k].from) {
    ++counters_.acquiring[k];
    return SyncVerdict::acquiring;
  }
  if (any_out_ && number <= last_out_) {
    const Gone& g = history_[number % kHistory];
    const bool of_it = !by_time || image.time - last_time_ >= -options_.tolerance.ns();
    const bool given =
        step == Step::again || (of_it && g.used && g.number == number && g.present[k]);
    ++(given ? counters_.duplicate : counters_.late)[k];
    return given ? SyncVerdict::duplicate : SyncVerdict::late;
  }
  Open* open = find(number);
  if (step == Step::again || (open != nullptr && open->set.present[k])) {
    ++counters_.duplicate[k];
    return SyncVerdict::duplicate;
  }
  if (open == nullptr) {
    open = std::find_if(open_.data(), open_.data() + open_.size(),
                        [](const Open& o) { return !o.used; });
    *open = Open{};
    open->used = true;
    open->set.number = number;
    open->first = frame.arrival;
    ++open_count_;
  }
  open->set.present[k] = true;
  open->set.slots[k] = frame.slot;
  open->set.arrivals[k] = frame.arrival;
  open->set.arrival = std::max(open->set.arrival, frame.arrival);
  open->images[k] = image;
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

bool RigSynchronizer::waited_for(std::size_t camera) const noexcept {
  return sources_[camera].here && proven(static_cast<int>(camera));
}

bool RigSynchronizer::ready(const Open& open) const noexcept {
  const std::uint64_t number = open.set.number;
  if (finishing_ || open_count_ > kOpen || now_ - open.first >= options_.hold || number < flushed_)
    return true;
  if (proves_numbers(options_.mode) && (train_.size() == 0 || train_.newest().number < number))
    return false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    const Source& s = sources_[k];
    if (open.set.present[k] && open.images[k].doubtful && matchers_[k].doubtful()) return false;
    const bool passed = s.any && !s.align && s.newest > number;
    if (waited_for(k) && !open.set.present[k] && !passed) return false;
  }
  return true;
}

bool RigSynchronizer::next(SyncedSet* set) noexcept {
  Open* open = oldest();
  if (open == nullptr || !ready(*open)) return false;
  emit(open, set);
  return true;
}

/// Camera 0's middle, or that of the first camera that is there.
void RigSynchronizer::stamp(const Open& open, SyncedSet* set) const noexcept {
  std::size_t base = 0;
  while (!set->present[base]) ++base;
  set->stamp = open.images[base].middle.host;
  set->error = open.images[base].middle.error;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k)
    if (set->present[k])
      set->spread = std::max(set->spread, magnitude(open.images[k].middle.host - set->stamp));
}

/// The pulse's edge on the host's clock, and from it to the middles of the exposures, as they were
/// fed back or as they were asked for.
void RigSynchronizer::stamp_by_pulse(const Open& open, SyncedSet* set) const noexcept {
  const PulseTrain::Entry* pulse = train_.find(set->number);
  std::size_t base = 0;
  while (!set->present[base]) ++base;
  set->reported = pulse != nullptr;
  MappedStamp edge{};
  if (pulse != nullptr) {
    edge = {pulse->host, pulse->host_error};
  } else {
    edge = train_.host_of(open.images[base].edge);
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

void RigSynchronizer::emit(Open* open, SyncedSet* set) noexcept {
  *set = open->set;
  const bool numbered = proves_numbers(options_.mode);
  // Pulses of a train that has ended are no longer known: their cameras' own stamps are.
  const bool of_train = numbered && train_.size() > 0 && set->number >= flushed_;
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
  if (!set->complete && open_count_ > kOpen) ++counters_.pushed_out;
  if (numbered) {
    counters_.missed +=
        any_out_ && last_out_ >= steady_from_ ? train_.between(last_out_, set->number) : 0;
  } else {
    counters_.missed += any_out_ ? set->number - last_out_ - 1 : set->number;
  }
  history_[set->number % kHistory] = {set->number, set->present, true};
  any_out_ = true;
  last_out_ = set->number;
  std::size_t base = 0;
  while (!set->present[base]) ++base;
  last_time_ = open->images[base].time;
  open->used = false;
  --open_count_;
}

/// What can be said of a set's togetherness, and whether the pulses have to be found again.
void RigSynchronizer::prove(Open* open, SyncedSet* set) noexcept {
  switch (options_.mode) {
    case SyncMode::software:
      set->proof = SyncProof::by_time;
      return;
    case SyncMode::bus:
    case SyncMode::ptp:
    case SyncMode::one_picture:
      set->proof = SyncProof::common_clock;
      return;
    case SyncMode::board:
    case SyncMode::ins_syncout:
    case SyncMode::master_strobe:
      for (std::size_t k = 0; k < matchers_.size(); ++k)
        open->contradicted = open->contradicted || (set->present[k] && open->images[k].doubtful &&
                                                    matchers_[k].doubtful());
      set->proof =
          options_.mode == SyncMode::master_strobe ? SyncProof::master : SyncProof::numbered;
      if (open->contradicted) {
        set->proof = SyncProof::unproven;
        ++counters_.unproven;
      }
      return;
    case SyncMode::counter:
      break;
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
  for (std::size_t k = 1; k < sources_.size(); ++k)
    sources_[k].align = true;  // to camera 0, whose numbers go on
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
  std::uint64_t next = 0;  // the first that is still waited for
  if (options_.mode == SyncMode::counter && !source.align) {
    const std::int64_t number = source.base + static_cast<std::int64_t>(counter);
    if (number < 0) return;
    next = static_cast<std::uint64_t>(number) + 1;
  } else if (proves_numbers(options_.mode) && matchers_[k].proven()) {
    next = matchers_[k].least_number(counter) + 1;
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
  source.align = options_.mode == SyncMode::counter;
  distrust(k);
  matchers_[k].restart();
  if (k == 0) master_.align = master_.known;
}

}  // namespace vergence
