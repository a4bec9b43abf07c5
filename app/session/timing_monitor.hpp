#pragma once
#include <array>

#include <nlohmann/json.hpp>

#include "app/devices/drive_devices.hpp"
#include "app/session/session_totals.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// Timing of a session: clocks, pairing, latencies, its stamps against the INS's UTC. Events
/// as messages, figures for summary.json.
///
/// Threads  note…(): the estimator's, sealed. json(): any, after that has joined. Memory: fixed;
///          messages are in place.
class TimingMonitor {
 public:
  struct Message {
    // Null if there is nothing to report.
    const char* kind = nullptr;
    std::array<char, 200> text{};
    bool to_user = false;
  };

  explicit TimingMonitor(SyncMode mode, bool virtual_time) : mode_(mode), virtual_(virtual_time) {}

  /// Message of a device event.
  [[nodiscard]] Message of_device(const DeviceEvent& event) const noexcept;
  /// A set that was handed out: tells when a run of ambiguous ones begins.
  [[nodiscard]] Message of_set(const SyncedSet& set) noexcept;
  /// A reading: tells when what the receiver and the filter say has changed, and of the
  /// session's stamps against UTC.
  [[nodiscard]] Message of_reading(const InsRecord& reading) noexcept;

  /// A pose of these images has gone out. `estimate_ms`: what it took; `now`: by the host's clock,
  /// meaningless in virtual time.
  void record_pose(const AcquiredFrame& frame, float estimate_ms, HostStamp now) noexcept;

  /// The block `time` of summary.json.
  [[nodiscard]] nlohmann::ordered_json json(const AcquisitionCounters& counters,
                                            const DriveDevices& devices) const;

 private:
  [[nodiscard]] Message of_utc(const InsRecord& reading) noexcept;

  SyncMode mode_;
  bool virtual_;
  // True if the last set was ambiguous.
  bool ambiguous_ = false;
  TimeHistogram latency_;
  // Quality reported last.
  InsQuality quality_{};
  FixStatus fix_ = FixStatus::none;
  bool any_quality_ = false, utc_reported_ = false;
  // Last reported lead of the session's stamps over the INS's UTC, in s.
  double reported_ahead_s_ = 0;
};

}  // namespace vergence::app
