#include <algorithm>

#include "drivers/sync/rig_synchronizer.hpp"

/// Determines the set of a frame, in modes with pulses by its pulse.
namespace vergence {

RigSynchronizer::Step RigSynchronizer::number_of(const SyncFrame& frame, std::uint64_t* number,
                                                 SetImage* image) noexcept {
  const auto k = static_cast<std::size_t>(frame.camera);
  if (verifies_numbers(options_.mode)) return number_by_pulse(frame, number, image);
  if (pairs_by_time(options_.mode)) {
    image->time = by_time_.time_of(frame, sets_);
    const TimeNumbering::Number found = by_time_.number_of(k, image->time, &sets_);
    counters_.contradictions[k] += found.clock_set ? 1 : 0;
    if (!found.number) return Step::late;
    *number = *found.number;
  } else {
    *number = by_counter_.number_of(k, frame.counter, frame.middle.host);
  }
  return Step::numbered;
}

Duration RigSynchronizer::noise_of(std::size_t camera) const noexcept {
  // Resolution of the edges of a trigger board or INS.
  constexpr Duration kTick = Duration::microseconds(1);
  const SyncCameraOptions &own = options_.camera[camera], &master = options_.camera[0];
  const bool by_master = options_.mode == SyncMode::master_strobe;
  return own.resolution + own.jitter + (by_master ? master.resolution + master.jitter : kTick);
}

void RigSynchronizer::pulse(const Pulse& pulse) noexcept {
  if (!requires_pulses(options_.mode)) return;
  now_ = std::max(now_, pulse.arrival);
  add_pulse(pulse);
}

void RigSynchronizer::begin_again() noexcept {
  ++counters_.reboots;
  sets_.flush();
  for (std::size_t k = 0; k < matchers_.size(); ++k) {
    sets_.contradict_suspect(k);
    matchers_[k].restart();
  }
}

void RigSynchronizer::acquired(std::size_t camera) noexcept {
  sources_[camera].from = sets_.any_out() ? sets_.last_out() + 1 : 0;
  steady_from_ = std::max(steady_from_, sets_.first_free());
}

void RigSynchronizer::add_pulse(const Pulse& pulse) noexcept {
  const PulseTrain::Step step = train_.add(pulse, sets_.first_free());
  if (step == PulseTrain::Step::known) return;
  if (step == PulseTrain::Step::began) begin_again();
  ++pulses_;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    PulseMatcher& matcher = matchers_[k];
    const bool verified = matcher.verified();
    if (const auto number = matcher.report(train_, now_)) {
      ++counters_.contradictions[k];
      sets_.contradict_suspect(k);
      OpenSet* open = sets_.find(*number);
      if (open != nullptr && open->set.present[k]) open->contradicted = true;
    }
    if (!verified && matcher.verified()) acquired(k);
  }
}

std::uint32_t RigSynchronizer::wants_pause() noexcept {
  // Unsuccessful trials of a camera.
  constexpr int kInVain = 8;
  // Number of pulses until a pause was seen or has had no effect.
  constexpr std::uint64_t kPatience = 3 * PulseMatcher::kRun;
  if (!verifies_numbers(options_.mode) || (asked_ && pulses_ < asked_at_ + kPatience)) return 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options_.cameras); ++k) {
    const bool settled = verified(static_cast<int>(k)) && !matchers_[k].suspect();
    if (!sources_[k].here || settled || matchers_[k].failures() < kInVain) continue;
    asked_ = true;
    asked_at_ = pulses_;
    return kPause;
  }
  return 0;
}

bool RigSynchronizer::verified(int camera) const noexcept {
  const bool is_master = options_.mode == SyncMode::master_strobe && camera == 0;
  return !verifies_numbers(options_.mode) || is_master ||
         matchers_[static_cast<std::size_t>(camera)].verified();
}

RigSynchronizer::Step RigSynchronizer::number_by_pulse(const SyncFrame& frame,
                                                       std::uint64_t* number,
                                                       SetImage* image) noexcept {
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
      sets_.contradict_suspect(k);
      [[fallthrough]];
    case PulseMatcher::Outcome::acquiring:
      ++counters_.acquiring[k];
      steady_from_ = std::max(steady_from_, sets_.first_free());
      if (matchers_[k].verified()) acquired(k);
      return Step::acquiring;
  }
  counters_.missed_trigger[k] += m.missed;
  counters_.lost[k] += m.lost;
  *number = m.number;
  image->edge = m.edge;
  image->gate = m.gate;
  image->suspect = m.suspect;
  return Step::numbered;
}

/// Camera 0 makes the pulses: each of its frames reports one.
RigSynchronizer::Step RigSynchronizer::number_by_master(const SyncFrame& frame,
                                                        std::uint64_t* number,
                                                        SetImage* image) noexcept {
  const MasterPulses::Report report = master_.frame(frame);
  image->edge = frame.exposure_start;
  counters_.contradictions[0] += report.contradicted ? 1 : 0;
  counters_.lost[0] += report.lost;
  if (!report.again) add_pulse(report.pulse);
  *number = train_.newest().number;
  return report.again ? Step::again : Step::numbered;
}

}  // namespace vergence
