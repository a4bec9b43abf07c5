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

#include "app/publish/live_frame.hpp"
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
/// Threads  One.
/// Full     After kMax places every other one goes, so 64 km are shown; then the oldest do.
class LiveTrail {
 public:
  static constexpr std::size_t kMax = 4000;

  struct Place {
    std::array<float, 3> world{};               // m, of the left camera
    std::optional<std::array<float, 2>> ins{};  // m: east, north
    std::uint8_t status = 0;                    // PoseStatus
  };

  void add(const Place& place);
  [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
  /// Where the places begin that the last call has not had, or not as they are.
  [[nodiscard]] std::size_t pop_new() noexcept { return std::exchange(shown_, places_.size()); }

 private:
  void thin();

  std::vector<Place> places_{};
  float min_step_m_ = 0.5F;
  std::size_t shown_ = 0;  // places that a viewer has as they are
};

/// State of the live page, kept so that a late viewer sees the whole session.
///
/// Threads  One. Memory  Bounded: the trail is thinned when it is full, of events and calibrations
///          the newest stay.
class LiveState {
 public:
  static constexpr std::size_t kEvents = 60, kCalibrations = 30;

  void begin(const SessionStart& start) { start_ = start; }
  void add(const LiveFrame& frame);
  void add(const FrameReport& report);
  void add(const EventRecord& event);
  void add(const CalibrationRecord& calibration);
  void add(const PublishedEnuAlignment& alignment);
  void end() noexcept { ended_ = true; }

  /// All there is to know, for a viewer who has just come. `now` tells whether frames still come.
  [[nodiscard]] std::string hello(HostStamp now) const;
  /// Changes since the last call, for connected viewers. `line_age_ms`: of the pose lines, 99th
  /// percentile; negative: none.
  [[nodiscard]] std::string update(HostStamp now, double line_age_ms);

 private:
  [[nodiscard]] static nlohmann::json place_json(const LiveTrail::Place& place);
  void add_interval(HostStamp out) noexcept;
  [[nodiscard]] nlohmann::json frame_json(HostStamp now) const;  // there is one
  [[nodiscard]] nlohmann::json calibration_json() const;

  SessionStart start_{};
  std::optional<LiveFrame> newest_{};
  double interval_s_ = 0;  // between frames, on the host's clock
  bool ended_ = false;
  TimeHistogram estimate_;
  std::optional<FrameReport> report_{};
  LiveTrail trail_;
  std::deque<EventRecord> events_{};
  std::uint64_t events_seen_ = 0, events_shown_ = 0;
  std::deque<CalibrationRecord> calibrations_{};
  std::optional<CalibrationRecord> in_use_{};
  std::optional<CalibrationRecord> measured_{};  // by the drive, beside the one in use
  bool confirmed_ = false;
  bool calibration_new_ = false;
  std::optional<PublishedEnuAlignment> alignment_{};
  bool alignment_new_ = false;
};

}  // namespace vergence::app
