#include "app/session/timing_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "app/devices/drive_sync.hpp"

namespace vergence::app {
namespace {

constexpr double kMicroseconds = 1e6;

double us(Duration d) { return d.to_seconds() * kMicroseconds; }

template <class... Arguments>
TimingMonitor::Sentence sentence(const char* kind, bool to_user, const char* format,
                                 Arguments... arguments) noexcept {
  TimingMonitor::Sentence s;
  s.kind = kind;
  s.to_user = to_user;
  (void)std::snprintf(s.text.data(), s.text.size(), format, arguments...);
  return s;
}

const char* word_of(FixStatus fix) noexcept {
  switch (fix) {
    case FixStatus::none:
      return "no position";
    case FixStatus::fix_2d:
      return "a fix without height";
    case FixStatus::fix_3d:
      return "a fix";
    case FixStatus::dead_reckoning:
      return "dead reckoning";
  }
  return "";
}

ClockFigures clock_figures(std::string device, const ClockRecord& clock) {
  ClockFigures f;
  f.device = std::move(device);
  f.stamps = clock.stamps();
  f.drift_ppm = clock.drift_ppm();
  f.error_us = us(clock.error());
  f.worst_error_us = us(clock.worst_error());
  return f;
}

ClockFigures::Pings pings_of(const trigger_board::TimeQuality& q) {
  ClockFigures::Pings p;
  p.asked = q.asked;
  p.answered = q.answered;
  p.rtt_least_us = us(q.rtt_least);
  p.rtt_median_us = us(q.rtt_median);
  p.rtt_most_us = us(q.rtt_most);
  p.pps_locked = q.pps_locked;
  p.pps_age_s = q.pps_age.to_seconds();
  return p;
}

}  // namespace

TimingMonitor::Sentence TimingMonitor::of_device(const DeviceEvent& event) const noexcept {
  using Kind = DeviceEvent::Kind;
  switch (event.kind) {
    case Kind::camera_gone:
      return sentence("camera_gone", true, "camera %d is gone; the drive goes on without it",
                      event.camera);
    case Kind::camera_back:
      return sentence("camera_back", true, "camera %d is back", event.camera);
    case Kind::board_gone:
      return sentence("board_gone", true,
                      "the trigger board is gone: check its cable; it is looked for every second");
    case Kind::board_back:
      return sentence("board_back", true, "the trigger board is back");
    case Kind::board_rebooted:
      return sentence("board_rebooted", true,
                      "the trigger board has restarted: its pulses count from 0, the pairing is "
                      "proven again");
    case Kind::acquiring:
      return sentence(
          "acquiring", false,
          "nothing proves yet which pulses the images of camera %d are of; they are not used",
          event.camera);
    case Kind::proven:
      return sentence("pairing_proven", false, "the pairing of camera %d is proven after %.2f s",
                      event.camera, event.seconds);
  }
  return {};
}

TimingMonitor::Sentence TimingMonitor::of_set(const SyncedSet& set) noexcept {
  const bool was = unproven_;
  unproven_ = set.proof == SyncProof::unproven;
  if (was || !unproven_) return {};
  return sentence(
      "pairing_unproven", true,
      "images do not belong together for sure: pulses, counters and stamps contradict each other%s",
      proves_pairing(mode_) ? "; one of them alone is used" : "");
}

TimingMonitor::Sentence TimingMonitor::of_reading(const AcquiredReading& reading) noexcept {
  constexpr int kMany = 3;  // satellites: one more or less is not worth a word
  const InsQuality& q = reading.quality;
  ++satellites_.readings;
  satellites_.without_fix += reading.sample.fix == FixStatus::none ? 1 : 0;
  const int count = q.satellites;
  if (count > 0) {
    satellites_.least = satellites_.most == 0 ? count : std::min(satellites_.least, count);
    satellites_.most = std::max(satellites_.most, count);
  }
  const bool changed = !any_quality_ || q.filter_valid != quality_.filter_valid ||
                       reading.sample.fix != fix_ ||
                       std::abs(count - int{quality_.satellites}) >= kMany;
  if (!changed) return of_utc(reading);
  any_quality_ = true;
  quality_ = q;
  fix_ = reading.sample.fix;
  std::array<char, 32> satellites{};
  if (count > 0)
    (void)std::snprintf(satellites.data(), satellites.size(), ", %d satellites", count);
  const bool given =
      q.status != 0 ||
      q.filter_valid;  // a device that says nothing of its filter has no status either
  return sentence("ins_status", false, "the INS has %s%s%s", word_of(fix_), satellites.data(),
                  !given           ? ""
                  : q.filter_valid ? ", its filter is valid"
                                   : ", its filter is not valid");
}

TimingMonitor::Sentence TimingMonitor::of_utc(const AcquiredReading& reading) noexcept {
  constexpr double kStep = 0.1;  // s: a clock that was set
  if (!reading.quality.utc_valid || reading.quality.utc_ns == 0) return {};
  const double ahead =
      static_cast<double>(reading.sample.stamp.ns() - reading.quality.utc_ns) * 1e-9;
  utc_.least_s = utc_.readings == 0 ? ahead : std::min(utc_.least_s, ahead);
  utc_.most_s = utc_.readings == 0 ? ahead : std::max(utc_.most_s, ahead);
  ++utc_.readings;
  sum_ahead_s_ += ahead;
  if (utc_reported_ && std::abs(ahead - reported_ahead_s_) < kStep) return {};
  utc_reported_ = true;
  reported_ahead_s_ = ahead;
  return sentence("utc", false,
                  "the session's stamps are %.4f s %s the INS's UTC: they follow the host's clock "
                  "of the day as it was at the start",
                  std::abs(ahead), ahead < 0 ? "behind" : "ahead of");
}

void TimingMonitor::note_pose(const AcquiredFrame& frame, float estimate_ms,
                              HostStamp now) noexcept {
  const SyncedSet& set = frame.set;
  const double ms =
      virtual_ ? (set.arrival - set.stamp).to_seconds() * 1e3 + static_cast<double>(estimate_ms)
               : (now - set.stamp).to_seconds() * 1e3;
  latency_.add(ms);
}

TimeFigures TimingMonitor::figures(const AcquisitionCounters& c,
                                   const DriveDevices& devices) const {
  TimeFigures f;
  const auto cameras = devices.cameras().size();
  for (std::size_t k = 0; k < cameras; ++k)
    f.clocks.push_back(clock_figures(fmt::format("camera {}", k), c.cameras[k]));
  if (c.board.stamps() > 0) {
    f.clocks.push_back(clock_figures("board", c.board));
    if (devices.board() != nullptr)
      f.clocks.back().pings = pings_of(devices.board()->board_statistics().time);
  }
  if (devices.ins() != nullptr) {
    f.clocks.push_back(clock_figures("INS", c.ins));
    const InsStatistics s = devices.ins()->statistics();
    f.ins = {{"lost", s.lost},
             {"malformed", s.malformed},
             {"restarts", s.restarts},
             {"overruns", s.overruns},
             {"dropped", c.dropped_readings}};
  }
  if (devices.trigger() != nullptr) {
    const TriggerStatistics s = devices.trigger()->statistics();
    f.board = {{"pulses", s.pulses},     {"lost", s.lost},       {"malformed", s.malformed},
               {"overruns", s.overruns}, {"reboots", c.reboots}, {"starts", s.starts}};
  }
  f.clock_resets = c.clock_resets;
  f.worst_stamp_error_us = static_cast<double>(c.worst_stamp_error_ns) * 1e-3;
  f.latency = latency_;
  f.latency_is_virtual = virtual_;
  f.utc = utc_;
  if (utc_.readings > 0) f.utc.host_ahead_s = sum_ahead_s_ / static_cast<double>(utc_.readings);
  f.satellites = satellites_;

  PairingFigures& p = f.pairing;
  p.mode = to_string(mode_);
  p.sentence = proof_sentence(mode_);
  p.can_be_proven = proves_pairing(mode_);
  p.worst_acquisition_s = c.sync.worst_acquisition.to_seconds();
  p.pauses = c.pauses;
  p.pauses_refused = c.pauses_refused;
  p.sets = {{"complete", c.sync.complete},
            {"incomplete", c.sync.incomplete},
            {"unproven", c.sync.unproven},
            {"unreported", c.sync.unreported},
            {"pulses", c.pulses},
            {"pulses_missed", c.sync.missed},
            {"pushed_out", c.sync.pushed_out},
            {"overtaken", c.dropped_sets},
            {"torn", c.torn}};
  for (std::size_t k = 0; k < cameras; ++k) {
    const CameraStatistics s = devices.cameras()[k]->statistics();
    CameraPairing camera;
    camera.proven = c.proven[k];
    camera.acquisitions = c.sync.acquisitions[k];
    camera.losses = {{"missed_trigger", c.sync.missed_trigger[k]},
                     {"lost", c.sync.lost[k]},
                     {"acquiring", c.sync.acquiring[k]},
                     {"contradictions", c.sync.contradictions[k]},
                     {"late", c.sync.late[k]},
                     {"duplicate", c.sync.duplicate[k]},
                     {"absent", c.sync.absent[k]},
                     {"torn", s.torn},
                     {"underruns", s.underruns}};
    p.cameras.push_back(std::move(camera));
  }
  return f;
}

}  // namespace vergence::app
