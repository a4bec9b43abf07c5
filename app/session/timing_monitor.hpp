#pragma once
#include <array>

#include <nlohmann/json.hpp>

#include "app/devices/drive_devices.hpp"
#include "app/session/session_totals.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// Timing of a session: clocks, pairing, latencies, and stamps against the INS's UTC. Reports
/// events as messages, and statistics for summary.json. record_…() and of_…() run on the
/// estimator's thread, which is sealed; json() after joining it. Fixed memory.
class TimingMonitor {
 public:
  struct Message {
    /// Null if there is nothing to report.
    const char* kind = nullptr;
    std::array<char, 200> text{};
    bool to_user = false;
  };

  explicit TimingMonitor(SyncMode mode, bool virtual_time) : mode_(mode), virtual_(virtual_time) {}

  /// Message of a device event.
  [[nodiscard]] Message of_device(const DeviceEvent& event) const noexcept;
  /// Handles an output set; reports the start of a run of ambiguous ones.
  [[nodiscard]] Message of_set(const SyncedSet& set) noexcept;
  /// Handles an INS sample; reports changed status of receiver or filter, and the session's stamps
  /// against UTC.
  [[nodiscard]] Message of_reading(const InsRecord& reading) noexcept;

  /// Records the pose of these images. `estimate_ms` is the estimation time, `now` the host time,
  /// which is meaningless in virtual time.
  void record_pose(const AcquiredFrame& frame, float estimate_ms, HostStamp now) noexcept;

  /// The block `time` of summary.json.
  [[nodiscard]] nlohmann::ordered_json json(const AcquisitionCounters& counters,
                                            const DriveDevices& devices) const;

 private:
  [[nodiscard]] Message of_utc(const InsRecord& reading) noexcept;

  SyncMode mode_;
  bool virtual_;
  // State of the last set.
  bool ambiguous_ = false;
  TimeHistogram latency_;
  // Last reported quality.
  InsQuality quality_{};
  FixStatus fix_ = FixStatus::none;
  bool any_quality_ = false, utc_reported_ = false;
  // Time by which the session's stamps are ahead of the INS's UTC.
  double reported_ahead_s_ = 0;
};

}  // namespace vergence::app
