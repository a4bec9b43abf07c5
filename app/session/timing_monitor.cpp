#include "app/session/timing_monitor.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "app/devices/drive_sync.hpp"
#include "app/session/summary.hpp"

namespace vergence::app {
namespace {

constexpr double kMicroseconds = 1e6;

double us(Duration d) { return d.to_seconds() * kMicroseconds; }

const char* fix_name(FixStatus fix) noexcept {
  constexpr std::array kNames{"no position", "dead reckoning", "a fix without height", "a fix"};
  return kNames[static_cast<std::size_t>(fix)];
}

/// Representation of a device event in events.jsonl.
struct DeviceReport {
  const char* kind;
  bool to_user;
  // Format of the message: {0} is the camera, {1} the seconds.
  const char* text;
};
/// In the order of DeviceEvent::Kind.
constexpr std::array kDeviceReports{
    DeviceReport{"camera_disconnected", true,
                 "camera {0} is disconnected; the run continues without it"},
    DeviceReport{"camera_reconnected", true, "camera {0} is reconnected"},
    DeviceReport{"trigger_board_disconnected", true,
                 "the trigger board is disconnected: check its cable; reconnecting every second"},
    DeviceReport{"trigger_board_reconnected", true, "the trigger board is reconnected"},
    DeviceReport{"trigger_board_restarted", true,
                 "the trigger board restarted: its pulses count from 0; the pairing is being "
                 "verified again"},
    DeviceReport{"pairing_pending", false,
                 "images of camera {0} are not used until their pulses are identified"},
    DeviceReport{"pairing_verified", false,
                 "the pairing of camera {0} is verified after {1:.2f} s"}};

using Json = nlohmann::ordered_json;

/// Three digits after the point: nanoseconds of microseconds, and a thousandth of a ppm.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json clock_json(const std::string& device, const ClockRecord& clock) {
  return {{"device", device},
          {"stamps", clock.stamps()},
          {"drift_ppm", rounded(clock.drift_ppm())},
          {"error_us", rounded(us(clock.error()))},
          {"worst_error_us", rounded(us(clock.worst_error()))}};
}

}  // namespace

SourceEvent TimingMonitor::of_device(const DeviceEvent& event) noexcept {
  const DeviceReport& report = kDeviceReports[static_cast<std::size_t>(event.kind)];
  return {
      EventRecord(event.stamp, report.kind, fmt::runtime(report.text), event.camera, event.seconds),
      report.to_user};
}

std::optional<SourceEvent> TimingMonitor::of_set(const AcquiredFrame& frame) noexcept {
  const bool was = std::exchange(ambiguous_, frame.set.proof == SyncProof::ambiguous);
  if (was || !ambiguous_) return std::nullopt;
  return SourceEvent{EventRecord(frame.rig.stamp, "pairing_ambiguous",
                                 "ambiguous pair: pulses, counters and stamps contradict each "
                                 "other{}",
                                 verifies_pairing(mode_) ? "; one image is used alone" : ""),
                     true};
}

std::optional<SourceEvent> TimingMonitor::of_reading(const InsRecord& reading) noexcept {
  // Minimum change of the satellite count that is reported.
  constexpr int kMany = 3;
  const InsQuality& q = reading.quality;
  const int count = q.satellites;
  const bool changed = !any_quality_ || q.filter_valid != quality_.filter_valid ||
                       reading.sample.fix != fix_ ||
                       std::abs(count - int{quality_.satellites}) >= kMany;
  if (!changed) return of_utc(reading);
  any_quality_ = true;
  quality_ = q;
  fix_ = reading.sample.fix;
  // A device that reports no filter state has no status either.
  const bool given = q.status != 0 || q.filter_valid;
  return SourceEvent{EventRecord(reading.sample.stamp, "ins_status",
                                 "the INS has {}, {} satellites{}", fix_name(fix_), count,
                                 !given           ? ""
                                 : q.filter_valid ? ", filter valid"
                                                  : ", filter not valid")};
}

std::optional<SourceEvent> TimingMonitor::of_utc(const InsRecord& reading) noexcept {
  // Minimum clock step in s that is reported.
  constexpr double kStep = 0.1;
  if (!reading.quality.utc_valid || reading.quality.utc_ns == 0) return std::nullopt;
  const double ahead =
      static_cast<double>(reading.sample.stamp.ns() - reading.quality.utc_ns) * 1e-9;
  if (reported_ahead_s_ && std::abs(ahead - *reported_ahead_s_) < kStep) return std::nullopt;
  reported_ahead_s_ = ahead;
  return SourceEvent{EventRecord(
      reading.sample.stamp, "utc_offset",
      "the session's stamps are {:.4f} s {} the INS's UTC; they follow the host clock at the start",
      std::abs(ahead), ahead < 0 ? "behind" : "ahead of")};
}

void TimingMonitor::record_pose(const AcquiredFrame& frame, float estimate_ms,
                                HostStamp now) noexcept {
  const SyncedSet& set = frame.set;
  latency_.add(virtual_ ? (set.arrival - set.stamp).to_seconds() * 1e3 + double{estimate_ms}
                        : (now - set.stamp).to_seconds() * 1e3);
}

nlohmann::ordered_json TimingMonitor::json(const AcquisitionCounters& c, std::size_t cameras,
                                           bool has_ins) const {
  Json clocks = Json::array();
  const bool verifiable = verifies_pairing(mode_);
  bool verified = verifiable;
  for (std::size_t k = 0; k < cameras; ++k) {
    clocks.push_back(clock_json(fmt::format("camera {}", k), c.cameras[k]));
    verified = verified && c.verified[k];
  }
  if (c.board.stamps() > 0) clocks.push_back(clock_json("board", c.board));
  if (has_ins) clocks.push_back(clock_json("INS", c.ins));
  Json latency;
  if (latency_.count() > 0) {
    latency = {{"mean", rounded(latency_.mean())}};
    latency.update(distribution_json(latency_));
    latency["virtual"] = virtual_;
  }
  return {{"clocks", clocks},
          {"worst_stamp_error_us", rounded(static_cast<double>(c.worst_stamp_error_ns) * 1e-3)},
          {"pairing",
           {{"mode", to_string(mode_)},
            {"message", proof_message(mode_)},
            {"verifiable", verifiable},
            {"verified", verified},
            {"worst_acquisition_s", rounded(c.sync.worst_acquisition.to_seconds())}}},
          {"latency_ms", latency}};
}

}  // namespace vergence::app
