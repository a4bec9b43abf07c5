#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "app/publish/pose_stream.hpp"
#include "app/session/records.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {

/// The points of the live page's map, farther apart as the drive grows longer. A place has the
/// worst status of all that was driven up to the next one.
///
/// Not thread-safe.
/// Full     After kMax places every other one goes, so 64 km are shown; then the oldest do.
class LiveTrail {
 public:
  static constexpr std::size_t kMax = 4000;

  struct Place {
    std::array<float, 3> world{};               // m, of the left camera
    std::optional<std::array<float, 2>> ins{};  // m: east, north
    std::uint8_t status = 0;                    // PoseStatus
    std::uint64_t version = 0;                  // of the state, when it was as it is
  };

  void add(const Place& place);
  [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
  /// Index of the first place that a viewer with this version does not have as it is.
  [[nodiscard]] std::size_t first_after(std::uint64_t version) const noexcept;

 private:
  void thin(std::uint64_t version);

  std::vector<Place> places_{};  // their versions ascend
  float min_step_m_ = 0.5F;
};

/// State of the live page, kept so that a late viewer sees the whole session. Every change has a
/// version, so that a viewer gets what has changed since the version that it has.
///
/// Not thread-safe. Memory is bounded: the trail is thinned when it is full, of events and
/// calibrations the newest stay.
class LiveState {
 public:
  static constexpr std::size_t kEvents = 60, kCalibrations = 30;

  void begin(const SessionStart& start) { start_ = start; }
  /// Adds a frame as soon as it has a pose: status, counts and times.
  void add_pose(const FrameReport& report);
  /// Adds the frame to the trail once it is compared with the INS.
  void add_report(const FrameReport& report);
  void add(const EventRecord& event);
  void add(const CalibrationRecord& calibration);
  void add(const PublishedEnuAlignment& alignment);
  void end() noexcept { ended_ = true; }

  /// Changes after `version`; 0: all that is known. `now` decides whether frames still come.
  /// `line_age_ms`: of the pose lines, 99th percentile; negative: none.
  [[nodiscard]] nlohmann::json since(std::uint64_t version, HostStamp now,
                                     double line_age_ms) const;

 private:
  [[nodiscard]] static nlohmann::json place_json(const LiveTrail::Place& place);
  void add_interval(HostStamp estimated) noexcept;
  [[nodiscard]] nlohmann::json frame_json(HostStamp now) const;  // there is one
  [[nodiscard]] nlohmann::json calibration_json() const;

  SessionStart start_{};
  double interval_s_ = 0;  // between frames, on the host's clock
  bool ended_ = false;
  TimeHistogram estimate_;
  std::optional<FrameReport> newest_{}, newest_report_{};
  LiveTrail trail_;
  std::uint64_t version_ = 1, calibration_version_ = 1, alignment_version_ = 0;
  std::deque<std::pair<std::uint64_t, EventRecord>> events_{};  // with the version of each
  std::deque<CalibrationRecord> calibrations_{};
  std::optional<CalibrationRecord> in_use_{};
  std::optional<CalibrationRecord> measured_{};  // by the drive, beside the one in use
  bool verified_ = false;
  std::optional<PublishedEnuAlignment> alignment_{};
};

}  // namespace vergence::app
