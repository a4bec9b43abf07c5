#include "drivers/sync/pulse_acquisition.hpp"

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
      count_ = tried_ = 0;  // it began to count from zero
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
  const bool proven = fits == 1 && strict && !(open_ended && beyond + kNear >= found) &&
                      believable(train, found, end);
  return Trial{proven, found, end};
}

/// The frame came no later than frames do, every pulse that it might be of instead was tried, and a
/// pause hides none.
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

/// Whether the run that ends before frame `end` fits with its last frame on the train's `place`.
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
    const Duration noise = noise_ * 2 + scaled(since, kMostDrift);
    const DeviceStamp target = edge - since;
    while (at > 0 && train[at].edge > target + noise * 2) --at;
    const PulseTrain::Entry& pulse = train[at];
    const Duration off = magnitude(pulse.edge - target);
    const auto counted =
        static_cast<std::uint64_t>(advance(frames_[i].counter, frames_[i + 1].counter));
    if (off <= noise * 2) {
      const Duration span = last.stamp - frames_[i].stamp;
      const Duration along = noise_ * 2 + scaled(span, kMostDrift);
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
      return pulse.resumed ? Fit::none : Fit::beyond;  // before the oldest that is held
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

}  // namespace vergence
