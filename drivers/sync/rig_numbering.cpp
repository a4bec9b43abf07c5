#include <algorithm>
#include <cmath>

#include "drivers/sync/rig_synchronizer.hpp"

/// Which set a frame belongs to: by its counter, by its time, by the pulse that made it.
namespace vergence {
namespace {

constexpr std::int64_t kBusWrap = 128'000'000'000;  // ns, of the IEEE 1394 cycle timer

std::size_t first_of(const SyncedSet& set) noexcept {
  std::size_t first = 0;
  while (first + 1 < set.present.size() && !set.present[first]) ++first;
  return first;
}

}  // namespace

// ---- by counter ----

std::uint64_t RigSynchronizer::number_of(const SyncFrame& frame) noexcept {
  constexpr std::uint64_t kLeap =
      100'000;  // pulses: over an hour of silence; a counter that leaps further is broken
  Source& source = sources_[static_cast<std::size_t>(frame.camera)];
  const auto counted =
      static_cast<std::uint64_t>(source.base) + frame.counter;  // wraps where the base is negative
  if (timed_ && counted > timed_number_ + kLeap) source.align = true;
  if (source.align) {
    source.align = false;
    if (timed_) {
      const double pulses =
          (frame.middle.host - timed_middle_).to_seconds() / options_.interval.to_seconds();
      source.base = static_cast<std::int64_t>(timed_number_) + std::llround(pulses) -
                    static_cast<std::int64_t>(frame.counter);
    } else {
      source.base = 0;
    }
  }
  const std::int64_t number = source.base + static_cast<std::int64_t>(frame.counter);
  return number < 0 ? 0 : static_cast<std::uint64_t>(number);
}

// ---- by time ----

/// Middle of the exposure on the clock that pairs. The bus's wraps: of the two unwrapped by their
/// cameras' drivers that nearest to the newest set's is meant.
std::int64_t RigSynchronizer::pairing_time(const SyncFrame& frame) const noexcept {
  if (options_.mode == SyncMode::software) return frame.middle.host.ns();
  const std::int64_t own = (frame.exposure_start + frame.exposure / 2).ns();
  if (options_.mode != SyncMode::bus || !(any_out_ || open_count_ > 0)) return own;
  std::int64_t reference = last_time_;
  for (const Open& o : open_)
    if (o.used) reference = o.images[first_of(o.set)].time;
  const std::int64_t apart = (own - reference) % kBusWrap;
  return reference + (apart > kBusWrap / 2    ? apart - kBusWrap
                      : apart < -kBusWrap / 2 ? apart + kBusWrap
                                              : apart);
}

/// A common clock that has been set back would make everything late for ever.
bool RigSynchronizer::ran_back(std::int64_t time) noexcept {
  constexpr int kBelieved = 3;
  constexpr std::int64_t kFarBack = 2'000'000'000;  // ns: no frame is late by that
  back_ = any_out_ && last_time_ - time > kFarBack ? back_ + 1 : 0;
  if (back_ < kBelieved) return false;
  back_ = 0;
  return true;
}

/// The number of the open set that it fits into, or a new one in the order of time; a number that
/// is out already: too late.
std::uint64_t RigSynchronizer::number_by_time(const SyncFrame& frame, std::int64_t time) noexcept {
  if (ran_back(time)) {
    ++counters_.contradictions[static_cast<std::size_t>(frame.camera)];
    flushed_ = first_free();
    new_clock_ = true;
  }
  const Open *best = nullptr, *newest = nullptr;
  std::int64_t nearest = options_.tolerance.ns();
  for (const Open& o : open_) {
    if (!o.used || o.set.number < flushed_) continue;
    if (newest == nullptr || o.set.number > newest->set.number) newest = &o;
    const std::int64_t distance = std::abs(time - o.images[first_of(o.set)].time);
    if (distance > nearest) continue;
    nearest = distance;
    best = &o;
  }
  if (best != nullptr) return best->set.number;
  if (new_clock_) {
    new_clock_ = false;
    return flushed_;
  }
  if (any_out_ && last_out_ >= flushed_ && time - last_time_ <= options_.tolerance.ns())
    return last_out_;
  if (newest == nullptr && !any_out_) return 0;
  const std::uint64_t reference = newest != nullptr ? newest->set.number : last_out_;
  const std::int64_t reference_time =
      newest != nullptr ? newest->images[first_of(newest->set)].time : last_time_;
  const std::int64_t steps = std::llround(static_cast<double>(time - reference_time) /
                                          static_cast<double>(options_.interval.ns()));
  const bool after = time > reference_time;
  const std::int64_t number =
      static_cast<std::int64_t>(reference) +
      (after ? std::max<std::int64_t>(steps, 1) : std::min<std::int64_t>(steps, -1));
  const bool taken = number < 0 || find(static_cast<std::uint64_t>(number)) != nullptr;
  return taken ? last_out_ : static_cast<std::uint64_t>(number);
}

// ---- by pulse ----

std::uint64_t RigSynchronizer::first_free() const noexcept {
  std::uint64_t free = any_out_ ? last_out_ + 1 : 0;
  for (const Open& o : open_)
    if (o.used) free = std::max(free, o.set.number + 1);
  return free;
}

Duration RigSynchronizer::noise_of(std::size_t camera) const noexcept {
  constexpr Duration kTick = Duration::microseconds(1);  // of a board's or an INS's edge
  const SyncCameraOptions &own = options_.camera[camera], &master = options_.camera[0];
  const bool by_master = options_.mode == SyncMode::master_strobe;
  return own.resolution + own.jitter + (by_master ? master.resolution + master.jitter : kTick);
}

void RigSynchronizer::pulse(const Pulse& pulse) noexcept {
  if (!wants_pulses(options_.mode)) return;
  now_ = std::max(now_, pulse.arrival);
  take_pulse(pulse);
}

void RigSynchronizer::begin_again() noexcept {
  ++counters_.reboots;
  flushed_ = first_free();
  for (std::size_t k = 0; k < matchers_.size(); ++k) {
    distrust(k);
    matchers_[k].restart();
  }
}

/// That camera's proof begins again: what was in doubt is so for good.
void RigSynchronizer::distrust(std::size_t camera) noexcept {
  for (Open& o : open_)
    if (o.used && o.set.present[camera] && o.images[camera].doubtful) o.contradicted = true;
}

void RigSynchronizer::acquired(std::size_t camera) noexcept {
  sources_[camera].from = any_out_ ? last_out_ + 1 : 0;
  steady_from_ = std::max(steady_from_, first_free());
}

void RigSynchronizer::take_pulse(const Pulse& pulse) noexcept {
  const PulseTrain::Step step = train_.add(pulse, first_free());
  if (step == PulseTrain::Step::known) return;
  if (step == PulseTrain::Step::began) begin_again();
  ++pulses_;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    PulseMatcher& matcher = matchers_[k];
    const bool proven = matcher.proven();
    if (const auto number = matcher.report(train_, now_)) {
      ++counters_.contradictions[k];
      distrust(k);
      Open* open = find(*number);
      if (open != nullptr && open->set.present[k]) open->contradicted = true;
    }
    if (!proven && matcher.proven()) acquired(k);
  }
}

std::uint32_t RigSynchronizer::wants_pause() noexcept {
  constexpr int kInVain = 8;  // trials of a camera
  constexpr std::uint64_t kPatience =
      3 * PulseMatcher::kRun;  // pulses, until a pause has been seen or has not helped
  if (!proves_numbers(options_.mode) || (asked_ && pulses_ < asked_at_ + kPatience)) return 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    const bool settled = proven(static_cast<int>(k)) && !matchers_[k].doubtful();
    if (!sources_[k].here || settled || matchers_[k].failures() < kInVain) continue;
    asked_ = true;
    asked_at_ = pulses_;
    return kPause;
  }
  return 0;
}

bool RigSynchronizer::proven(int camera) const noexcept {
  const bool is_master = options_.mode == SyncMode::master_strobe && camera == 0;
  return !proves_numbers(options_.mode) || is_master ||
         matchers_[static_cast<std::size_t>(camera)].proven();
}

RigSynchronizer::Step RigSynchronizer::number_by_pulse(const SyncFrame& frame,
                                                       std::uint64_t* number,
                                                       Image* image) noexcept {
  const auto k = static_cast<std::size_t>(frame.camera);
  if (options_.mode == SyncMode::master_strobe && k == 0)
    return number_by_master(frame, number, image);
  const PulseMatcher::Match m =
      matchers_[k].frame(train_, frame.counter, frame.exposure_start, frame.arrival);
  switch (m.outcome) {
    case PulseMatcher::Outcome::matched:
      break;
    case PulseMatcher::Outcome::again:
      *number = m.number;
      return Step::again;
    case PulseMatcher::Outcome::contradicted:
      ++counters_.contradictions[k];
      distrust(k);
      [[fallthrough]];
    case PulseMatcher::Outcome::acquiring:
      ++counters_.acquiring[k];
      steady_from_ = std::max(steady_from_, first_free());
      if (matchers_[k].proven()) acquired(k);
      return Step::acquiring;
  }
  counters_.missed_trigger[k] += m.missed;
  counters_.lost[k] += m.lost;
  *number = m.number;
  image->edge = m.edge;
  image->gate = m.gate;
  image->doubtful = m.doubtful;
  return Step::numbered;
}

/// Camera 0 makes the pulses: its frame is the report of one.
RigSynchronizer::Step RigSynchronizer::number_by_master(const SyncFrame& frame,
                                                        std::uint64_t* number,
                                                        Image* image) noexcept {
  const auto counted = static_cast<std::int64_t>(frame.counter - master_.counter);
  Pulse pulse;
  pulse.edge = image->edge = frame.exposure_start;
  pulse.arrival = frame.arrival;
  pulse.mapped = true;
  pulse.host = frame.middle.host - frame.exposure / 2;
  pulse.host_error = frame.middle.error;
  if (!master_.known) {
    pulse.resumed = true;
  } else if (master_.align) {
    const Duration since = frame.exposure_start - master_.stamp;
    const std::int64_t steps = (since + options_.interval / 2).ns() / options_.interval.ns();
    pulse.resumed = true;
    master_.base = master_.base + master_.counter +
                   static_cast<std::uint64_t>(std::max<std::int64_t>(steps, 1)) - frame.counter;
  } else if (counted <= 0) {
    if (counted == 0 && frame.exposure_start == master_.stamp) {
      *number = train_.newest().number;
      return Step::again;
    }
    ++counters_.contradictions[0];
    ++master_.boot;
  } else {
    counters_.lost[0] += static_cast<std::uint64_t>(counted) - 1;
    pulse.resumed =
        frame.exposure_start - master_.stamp > options_.interval * counted + options_.interval / 2;
  }
  pulse.number = master_.base + frame.counter;
  pulse.boot = master_.boot;
  master_ = {true, false, master_.base, frame.counter, frame.exposure_start, master_.boot};
  take_pulse(pulse);
  *number = train_.newest().number;
  return Step::numbered;
}

}  // namespace vergence
