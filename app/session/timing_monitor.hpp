#pragma once
#include <optional>

#include <nlohmann/json.hpp>

#include "app/session/frame_source.hpp"
#include "app/session/session_totals.hpp"
#include "drivers/acquisition/acquisition.hpp"

namespace vergence::app {

/// Timing of a session: clocks, pairing and latencies. Events as messages, figures for
/// summary.json.
///
/// Threads  note…(): the estimator's, sealed. json(): any, after that has joined. Memory: fixed;
///          messages are in place.
class TimingMonitor {
 public:
  explicit TimingMonitor(SyncMode mode, bool virtual_time) : mode_(mode), virtual_(virtual_time) {}

  /// Event of a device.
  [[nodiscard]] static SourceEvent of_device(const DeviceEvent& event) noexcept;
  /// Event of a set that was handed out, if a run of ambiguous ones begins.
  [[nodiscard]] std::optional<SourceEvent> of_set(const AcquiredFrame& frame) noexcept;
  /// Event of an INS sample, if the state of the receiver or the filter has changed, or the offset
  /// of the session's stamps from UTC.
  [[nodiscard]] std::optional<SourceEvent> of_reading(const InsRecord& reading) noexcept;

  /// A pose of these images has gone out. `estimate_ms`: what it took; `now`: by the host's clock,
  /// meaningless in virtual time.
  void record_pose(const AcquiredFrame& frame, float estimate_ms, HostStamp now) noexcept;

  /// The block `time` of summary.json.
  [[nodiscard]] nlohmann::ordered_json json(const AcquisitionCounters& counters,
                                            std::size_t cameras, bool has_ins) const;

 private:
  [[nodiscard]] std::optional<SourceEvent> of_utc(const InsRecord& reading) noexcept;

  SyncMode mode_;
  bool virtual_;
  // True if the last set was ambiguous.
  bool ambiguous_ = false;
  TimeHistogram latency_;
  // Quality reported last.
  InsQuality quality_{};
  FixStatus fix_ = FixStatus::none;
  bool any_quality_ = false;
  // Last reported lead of the session's stamps over the INS's UTC, in s.
  std::optional<double> reported_ahead_s_{};
};

}  // namespace vergence::app
