#include "drivers/sync/pulse_matcher.hpp"

#include <algorithm>

#include "drivers/sync/clock_tie.hpp"
#include "drivers/sync/durations.hpp"

namespace vergence {

void PulseAcquisition::clear() noexcept {
  count_ = tried_ = 0;
  begun_ = false;
}

void PulseAcquisition::add(const StampedFrame& frame) noexcept {
  if (!begun_) {
    begun_ = true;
    began_ = frame.arrival;
  }
  if (count_ > 0) {
    const StampedFrame& last = frames_[count_ - 1];
    if (frame.counter == last.counter && frame.stamp == last.stamp) return;
    if (advance(last.counter, frame.counter) < 1 || frame.stamp <= last.stamp)
      // The counter restarted.
      count_ = tried_ = 0;
  }
  if (count_ == kFrames) {
    std::move(frames_.begin() + 1, frames_.end(), frames_.begin());
    --count_;
    tried_ -= tried_ > 0 ? 1 : 0;
  }
  frames_[count_++] = frame;
}

std::optional<PulseAcquisition::Trial> PulseAcquisition::attempt(const PulseTrain& train) noexcept {
  if (train.size() < kRun) return std::nullopt;
  const HostStamp known_until = train.newest().host - train.newest().host_error;
  std::size_t end = count_;
  while (end > 0 && frames_[end - 1].arrival > known_until) --end;
  if (end < kRun || end == tried_) return std::nullopt;
  tried_ = end;
  std::size_t found = 0, fits = 0, beyond = 0;
  bool strict = false, open_ended = false;
  for (std::size_t place = 0; place < train.size(); ++place) {
    const Fit f = fit(train, place, end);
    if (f == Fit::beyond) {
      open_ended = true;
      beyond = place;
    }
    if (f != Fit::strict && f != Fit::loose) continue;
    ++fits;
    strict = f == Fit::strict;
    found = place;
  }
  const bool verified = fits == 1 && strict && !(open_ended && beyond + kNear >= found) &&
                        believable(train, found, end);
  return Trial{verified, found, end};
}

/// True if the frame was not late, every other possible pulse was tried and no pause hides one.
bool PulseAcquisition::believable(const PulseTrain& train, std::size_t place,
                                  std::size_t end) const noexcept {
  if (frames_[end - 1].arrival - train[place].host > latest_) return false;
  const std::size_t until = std::min(train.size(), place + kNear + 1);
  for (std::size_t i = place > 2 * kRun ? place - 2 * kRun : 1; i < until; ++i) {
    const std::uint64_t left_out = train[i].number - train[i - 1].number - 1;
    const bool beside = i + kNear >= place,
               pause = train[i].resumed && (pause_ == 0 || left_out == pause_);
    if (left_out > 0 && !pause && (beside || train[i].resumed)) return false;
  }
  return true;
}

/// Checks whether the run before frame `end` fits with its last frame at `place` of the train.
PulseAcquisition::Fit PulseAcquisition::fit(const PulseTrain& train, std::size_t place,
                                            std::size_t end) const noexcept {
  const std::size_t begin = end - kRun;
  const StampedFrame& last = frames_[end - 1];
  std::size_t at = place;
  DeviceStamp edge = train[place].edge;
  std::uint64_t number = train[place].number, skipped = train[place].skipped, odd = 0;
  bool strict = true;
  for (std::size_t i = end - 1; i-- > begin;) {
    const Duration since = frames_[i + 1].stamp - frames_[i].stamp;
    const Duration noise = noise_ * 2 + scaled(since, kMaxDrift);
    const DeviceStamp target = edge - since;
    while (at > 0 && train[at].edge > target + noise * 2) --at;
    const PulseTrain::Entry& pulse = train[at];
    const Duration off = magnitude(pulse.edge - target);
    const auto counted =
        static_cast<std::uint64_t>(advance(frames_[i].counter, frames_[i + 1].counter));
    if (off <= noise * 2) {
      const Duration span = last.stamp - frames_[i].stamp;
      const Duration along = noise_ * 2 + scaled(span, kMaxDrift);
      const Duration apart = magnitude((train[place].edge - pulse.edge) - span);
      if (apart > along * 2) return Fit::none;
      strict = strict && off <= noise && apart <= along;
      const std::uint64_t least = PulseTrain::least(pulse.number, pulse.skipped, number, skipped);
      if (counted > number - pulse.number) return Fit::none;
      odd += least > counted ? least - counted : 0;
      edge = pulse.edge;
      number = pulse.number;
      skipped = pulse.skipped;
    } else if (pulse.edge > target) {
      // The target is before the oldest pulse held.
      return pulse.resumed ? Fit::none : Fit::beyond;
    } else {
      const auto unreported = train.place(target, Duration{});
      if (!unreported || unreported->number >= number) return Fit::none;
      if (counted > number - unreported->number) return Fit::none;
      const std::uint64_t least =
          PulseTrain::least(unreported->number, unreported->skipped_with, number, skipped);
      odd += (least > counted ? least - counted : 0) + (unreported->paused ? 1 : 0);
      strict = false;
      edge = target;
      number = unreported->number;
      skipped = unreported->skipped;
    }
  }
  if (odd > kOdd) return Fit::none;
  return strict && odd == 0 ? Fit::strict : Fit::loose;
}

bool MissedTriggerTest::add(std::uint64_t missed) noexcept {
  pulses_ += missed;
  rivals_ = {};
  return pulses_ <= kMax;
}

bool MissedTriggerTest::compare(const PulseTrain& train, std::uint64_t number,
                                Duration limit) noexcept {
  const PulseTrain::Entry* pulse = train.find(number);
  bool all = true;
  for (std::size_t s = 1; s <= pulses_; ++s) {
    Rival& rival = rivals_[s - 1];
    const PulseTrain::Entry* earlier = train.before(number, s);
    if (!rival.refuted && pulse != nullptr && earlier != nullptr) {
      const Duration apart = pulse->edge - earlier->edge;
      rival.least = rival.compared ? std::min(rival.least, apart) : apart;
      rival.greatest = rival.compared ? std::max(rival.greatest, apart) : apart;
      rival.compared = true;
      rival.refuted = rival.greatest - rival.least > limit;
    }
    all = all && rival.refuted;
  }
  if (all) clear();
  return all;
}

void PulseMatcher::restart() noexcept {
  verified_ = false;
  acquisition_.clear();
  recents_ = pendings_ = 0;
  failures_ = 0;
  missed_trigger_.clear();
}

std::uint64_t PulseMatcher::min_number(std::uint64_t counter) const noexcept {
  const std::int64_t steps = advance(last_.counter, counter);
  return steps > 0 ? last_.number + static_cast<std::uint64_t>(steps) : last_.number;
}

PulseMatcher::Match PulseMatcher::frame(const PulseTrain& train, std::uint64_t counter,
                                        DeviceStamp stamp, HostStamp arrival) noexcept {
  const StampedFrame frame{counter, stamp, arrival, 0};
  if (verified_) return match(train, frame);
  acquisition_.add(frame);
  acquire(train, arrival);
  return {};
}

std::optional<std::uint64_t> PulseMatcher::report(const PulseTrain& train,
                                                  HostStamp arrival) noexcept {
  if (!verified_) {
    acquire(train, arrival);
    return std::nullopt;
  }
  const PulseTrain::Entry& pulse = train.newest();
  const std::uint64_t before = train.size() > 1 ? train[train.size() - 2].number : pulse.number;
  std::size_t kept = 0;
  std::optional<StampedFrame> made;
  for (std::size_t i = 0; i < pendings_; ++i) {
    const StampedFrame& frame = pending_[i];
    const bool at_edge =
                   magnitude(pulse.edge - tie_.to_edge(frame.stamp)) <= tie_.gate(frame.stamp),
               numbered = frame.number == pulse.number;
    const bool in_pause = pulse.resumed && frame.number < pulse.number && frame.number > before;
    if (at_edge != numbered || in_pause) {
      const std::uint64_t number = frame.number;
      restart();
      return number;
    }
    if (numbered) made = frame;
    // Reports are in order, so an older pulse will never be reported.
    if (frame.number > pulse.number) pending_[kept++] = frame;
  }
  pendings_ = kept;
  if (made) {
    tie_.add(made->stamp, pulse.edge);
    settle(train, pulse.number);
  }
  return std::nullopt;
}

// ---- acquiring ----

void PulseMatcher::acquire(const PulseTrain& train, HostStamp now) noexcept {
  const auto trial = acquisition_.attempt(train);
  if (!trial) return;
  if (trial->verified)
    adopt(train, *trial, now);
  else
    ++failures_;
}

void PulseMatcher::adopt(const PulseTrain& train, const PulseAcquisition::Trial& trial,
                         HostStamp now) noexcept {
  verified_ = true;
  failures_ = 0;
  ++acquisitions_;
  worst_acquisition_ = std::max(worst_acquisition_, now - acquisition_.began());
  tie_.clear();
  recents_ = pendings_ = 0;
  // Goes through the run forwards again; with the offset known every frame has its pulse.
  const auto frames = acquisition_.frames();
  const auto run = frames.subspan(trial.end - kRun, kRun);
  std::size_t at = trial.place;
  std::array<std::size_t, kRun> places{};
  for (std::size_t i = kRun; i-- > 0;) {
    const Duration span = run.back().stamp - run[i].stamp;
    const DeviceStamp target = train[trial.place].edge - span;
    while (at > 0 && magnitude(train[at - 1].edge - target) < magnitude(train[at].edge - target))
      --at;
    places[i] = at;
  }
  for (std::size_t i = 0; i < kRun; ++i) {
    StampedFrame frame = run[i];
    const PulseTrain::Entry& pulse = train[places[i]];
    frame.number = pulse.number;
    tie_.add(frame.stamp, pulse.edge);
    const Duration delay = frame.arrival - pulse.host;
    min_delay_ = i == 0 ? delay : std::min(min_delay_, delay);
    last_ = frame;
    last_skipped_ = pulse.skipped;
    recent_[recents_++ % kRecent] = frame;
  }
  // Matches the frames since; a contradiction among them revokes the verification.
  std::array<StampedFrame, PulseAcquisition::kFrames> later{};
  const std::size_t waiting = frames.size() - trial.end;
  std::copy_n(frames.begin() + static_cast<std::ptrdiff_t>(trial.end), waiting, later.begin());
  acquisition_.clear();
  for (std::size_t i = 0; i < waiting && verified_; ++i) (void)match(train, later[i]);
}

// ---- verified ----

PulseMatcher::Match PulseMatcher::contradict(const StampedFrame& frame) noexcept {
  restart();
  acquisition_.add(frame);
  Match m;
  m.outcome = Outcome::contradicted;
  return m;
}

PulseMatcher::Match PulseMatcher::repeated(const StampedFrame& frame) const noexcept {
  Match m;
  for (std::size_t i = 0; i < std::min(recents_, kRecent); ++i) {
    if (recent_[i].counter != frame.counter || recent_[i].stamp != frame.stamp) continue;
    m.outcome = Outcome::again;
    m.number = recent_[i].number;
  }
  return m;
}

/// Handles a frame that fits this reported pulse within the gate.
void PulseMatcher::settle(const PulseTrain& train, std::uint64_t number) noexcept {
  if (!missed_trigger_.any()) return;
  ++failures_;
  if (missed_trigger_.compare(train, number, tie_.gate() * 2)) failures_ = 0;
}

PulseMatcher::Match PulseMatcher::match(const PulseTrain& train,
                                        const StampedFrame& frame) noexcept {
  const std::int64_t counted = advance(last_.counter, frame.counter);
  if (counted <= 0) {
    const Match m = repeated(frame);
    return m.outcome == Outcome::again ? m : contradict(frame);
  }
  Match m;
  m.edge = tie_.to_edge(frame.stamp);
  m.gate = tie_.gate(frame.stamp);
  // After a long gap the stamp no longer identifies the pulse.
  if (m.gate * 3 > interval_) return contradict(frame);
  const auto place = train.place(m.edge, m.gate);
  if (!place || place->paused || place->number <= last_.number) return contradict(frame);
  const std::uint64_t most = place->number - last_.number;
  const std::uint64_t least =
      PulseTrain::least(last_.number, last_skipped_, place->number, place->skipped);
  const auto exposures = static_cast<std::uint64_t>(counted);
  if (exposures > most) return contradict(frame);
  m.missed = least > exposures ? least - exposures : 0;
  m.lost = exposures - 1;
  // A clock that was set may point to another pulse; the frame then seems faster than any before,
  // or precedes its pulse.
  const MappedStamp host = train.to_host(m.edge);
  const Duration delay = frame.arrival - host.host;
  if (delay < -host.error || (m.missed > 0 && delay + interval_ / 2 < min_delay_))
    return contradict(frame);
  min_delay_ = std::min(min_delay_, delay);
  if (m.missed > 0 && !missed_trigger_.add(m.missed)) return contradict(frame);
  m.outcome = Outcome::matched;
  m.number = place->number;
  last_ = frame;
  last_.number = m.number;
  last_skipped_ = place->skipped_with;
  recent_[recents_++ % kRecent] = last_;
  if (place->entry != nullptr) {
    // Reports are in order, so older pulses will never be reported.
    pendings_ = 0;
    tie_.add(frame.stamp, place->entry->edge);
    settle(train, m.number);
  } else if (train.newest().number < m.number) {
    if (pendings_ == kPending) {
      std::move(pending_.begin() + 1, pending_.end(), pending_.begin());
      --pendings_;
    }
    pending_[pendings_++] = last_;
  }
  m.suspect = suspect();
  return m;
}

}  // namespace vergence
