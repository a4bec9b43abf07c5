#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "app/session/earth_figures.hpp"
#include "app/session/event_log.hpp"
#include "app/session/ins_events.hpp"
#include "app/session/session_observer.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app {

/// What a drive does with its INS, live or recorded alike: the comparison pose by pose into the
/// recorder, and what there is to tell of it.
///
/// Threads    The estimator's, sealed; after it has joined all is anyone's.
/// Memory     The comparison's, from the arena.
/// Order      Readings and poses as they come; every add() of a pose is followed by drain().
class InsComparison {
 public:
  /// That are kept for the files at the end; later ones are in poses.csv alone, and count.
  static constexpr std::size_t kMostPlacements = 4096;

  /// Without a source poses go through and nothing is said. `event_log` outlives it.
  InsComparison(const ComparisonOptions& options, InsSource source, Arena& arena,
                EventLog& event_log);

  /// Before the first add(). `output` outlives the last one; with a source its recorder takes
  /// readings (Recorder::Options::ins).
  void open(SessionOutput* output) noexcept { output_ = output; }
  void add(const InsRecord& reading) noexcept;
  /// `decode_ms` of its images goes with the pose.
  void add(const PoseSample& pose, float decode_ms) noexcept;
  /// Hands on every pose that has met its readings.
  void drain() noexcept;
  /// No more readings and poses will come.
  void finish() noexcept;

  /// Poses that the INS had a place for.
  [[nodiscard]] std::uint64_t matches() const noexcept { return matches_; }
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;
  /// `mount_source`: where the mount of the options is from.
  [[nodiscard]] EarthFigures earth(const std::string& mount_source) const;

 private:
  void measure_way(const ComparedPose& pose) noexcept;
  void measure_errors(const ComparedPose& pose) noexcept;
  void take_placement(Stamp stamp) noexcept;
  const Transform T_ins_left_;
  Comparison comparison_;
  EventLog& event_log_;
  InsEvents events_;
  SessionOutput* output_ = nullptr;
  std::array<float, Comparison::kPending> decode_ms_{};  // of the poses that wait, by their count
  std::uint64_t added_ = 0, drained_ = 0;
  std::uint64_t matches_ = 0, scale_disagreements_ = 0;
  std::uint32_t placement_revision_ = 0;
  std::vector<PlacementRecord> placements_;  // its memory is taken at construction
  EarthErrors errors_{};                     // means and roots are squares' sums until earth()
  std::uint64_t heights_ = 0;                // poses whose error upwards is in errors_
  bool on_way_ = false;                      // last_place_ means something
  Vec2 last_place_ = Vec2::Zero();           // where the newest whole step of the way ended
  double beyond_ = 0;                        // m from there to the newest place
  Stamp newest_stamp_{};
};

}  // namespace vergence::app
