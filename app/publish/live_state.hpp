#pragma once
#include <deque>

#include <nlohmann/json_fwd.hpp>

#include "app/publish/pose_stream.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/session_totals.hpp"

namespace vergence::app {

/// Points of the live page's map, sparser as the run grows longer. A point has the worst status up
/// to the next one. Beyond kMax points every other one is removed, which suffices for 64 km; then
/// the oldest are dropped. Not thread-safe.
class LiveTrail {
 public:
  static constexpr std::size_t kMax = 4000;

  struct Place {
    /// Position of the left camera, in m.
    std::array<float, 3> world{};
    /// East and north, in m.
    std::optional<std::array<float, 2>> ins{};
    /// Value of PoseStatus.
    std::uint8_t status = 0;
    /// Version of the state at the last change.
    std::uint64_t version = 0;
  };

  void add(const Place& place);
  [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
  /// Index of the first point that a viewer with this version lacks or has outdated.
  [[nodiscard]] std::size_t first_after(std::uint64_t version) const noexcept;

 private:
  void thin(std::uint64_t version);

  // Ordered by version.
  std::vector<Place> places_{};
  float min_step_m_ = 0.5F;
};

/// Report of a frame before its comparison with the INS.
struct PosedFrame {
  FrameReport report{};
};

/// State of the live page, kept so that a late viewer sees the whole session. Every change has a
/// version, so that a viewer gets only later changes. Not thread-safe. Memory is bounded: the trail
/// is thinned, and the newest events and calibrations are kept.
class LiveState {
 public:
  static constexpr std::size_t kEvents = 60, kCalibrations = 30;

  void begin(const SessionStart& start) { start_ = start; }
  /// Adds a frame with its pose: status, counts and times.
  void add(const PosedFrame& posed);
  /// Adds a frame to the trail after its comparison with the INS.
  void add(const FrameReport& report);
  void add(const EventRecord& event);
  void add(const CalibrationRecord& calibration);
  void add(const PublishedEnuAlignment& alignment);
  void end() noexcept { ended_ = true; }

  /// Changes after `version`; 0 returns everything. `now` determines whether frames still arrive.
  [[nodiscard]] nlohmann::json since(std::uint64_t version, HostStamp now) const;

 private:
  [[nodiscard]] static nlohmann::json place_json(const LiveTrail::Place& place);
  void add_interval(HostStamp estimated) noexcept;
  // Precondition: there is a frame.
  [[nodiscard]] nlohmann::json frame_json(HostStamp now) const;
  [[nodiscard]] nlohmann::json calibration_json() const;

  SessionStart start_{};
  // Interval of frames on the host's clock.
  double interval_s_ = 0;
  bool ended_ = false;
  TimeHistogram estimate_;
  std::optional<FrameReport> newest_{}, newest_report_{};
  LiveTrail trail_;
  std::uint64_t version_ = 1, calibration_version_ = 1, alignment_version_ = 0;
  // Events with their versions.
  std::deque<std::pair<std::uint64_t, EventRecord>> events_{};
  std::deque<CalibrationRecord> calibrations_{};
  std::optional<CalibrationRecord> in_use_{};
  // Estimated online, in addition to the one in use.
  std::optional<CalibrationRecord> measured_{};
  bool verified_ = false;
  std::optional<PublishedEnuAlignment> alignment_{};
};

}  // namespace vergence::app
