#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "app/session/event_log.hpp"
#include "app/session/session_observer.hpp"
#include "core/comparison/comparison.hpp"
#include "core/comparison/enu_alignment.hpp"
#include "core/math/se3.hpp"
#include "core/types/ins_sample.hpp"

namespace vergence::app {

/// An alignment and the stamp from which it holds.
struct EnuAlignmentRecord {
  Stamp stamp{};
  EnuAlignment alignment{};
};

/// Errors against the INS after the alignment, over the poses that were compared.
struct EnuErrors {
  std::uint64_t poses = 0;
  double ins_path_m =
      0;  // of the INS across the ground from its first fix on, straight across holes
  double horizontal_rms_m = 0, horizontal_max_m = 0, horizontal_end_m = 0;
  double up_rms_m = 0, up_end_m = 0;                                     // ours − INS
  double heading_rms_deg = 0, heading_max_deg = 0, heading_end_deg = 0;  // the end clockwise
};

/// Where a drive lies on the earth, and how far from the INS it is there.
struct EnuMetrics {
  std::optional<Geodetic> origin{};  // of enu; nothing: the INS never had a fix
  std::vector<EnuAlignmentRecord> alignments{};
  EnuErrors errors{};
  Transform T_ins_left{};      // the mount that the comparison took
  std::string mount_source{};  // where it is from
};

/// Null without an origin.
[[nodiscard]] nlohmann::ordered_json enu_json(const EnuMetrics& metrics);

enum class InsSource : std::uint8_t { none, device, recording };

/// Events about an INS and its comparison with the poses: each once, where something changes.
/// Threads: the estimator's, sealed.
class InsEvents {
 public:
  /// Without a source nothing is said about its silence. `event_log` outlives this.
  InsEvents(InsSource source, double scale_stretch_m, EventLog& event_log) noexcept
      : source_(source), scale_stretch_m_(scale_stretch_m), event_log_(event_log) {}

  /// A reading, after the comparison has counted `jumps` of the position. `contradicted`: an
  /// attitude did not go with the way driven.
  void update(const InsSample& sample, std::uint64_t jumps, bool contradicted) noexcept;
  /// A pose that has met its readings, the `matches`-th that found any.
  void update(const ComparedPose& pose, std::uint64_t matches) noexcept;
  void update(const EnuAlignment& alignment, Stamp stamp) noexcept;

 private:
  void record_attitude(const InsSample& sample) noexcept;
  void record_match(const ComparedPose& pose, std::uint64_t matches) noexcept;
  void record_scale(const ComparedPose& pose) noexcept;

  const InsSource source_;
  const double scale_stretch_m_;
  EventLog& event_log_;
  bool attitude_reported_ = false, contradiction_reported_ = false, scale_disagrees_ = false;
  std::uint64_t jumps_ = 0;
  InsMatch last_match_ = InsMatch::ok;
  std::uint64_t match_run_ = 0;  // poses in a row with that
};

/// Comparison of a session with its INS, live or recorded: the comparison pose by pose into the
/// recorder, and what there is to tell of it.
///
/// Threads    The estimator's, sealed; after it has joined all is anyone's.
/// Memory     The comparison's, from the arena.
/// Order      Readings and poses as they come; every add() of a pose is followed by drain().
class InsComparison {
 public:
  /// That are kept for the files at the end; later ones are in poses.csv alone, and count.
  static constexpr std::size_t kMaxPlacements = 4096;

  /// Without a source poses go through and nothing is said. `event_log` outlives it.
  InsComparison(const ComparisonOptions& options, InsSource source, Arena& arena,
                EventLog& event_log);

  /// Before the first add(). `output` outlives the last one; with a source its recorder takes
  /// readings (Recorder::Options::ins).
  void open(SessionOutput* output) noexcept { output_ = output; }
  void add(const InsRecord& reading) noexcept;
  void add(const FrameReport& report) noexcept;
  /// Hands on every pose that has met its readings.
  void drain() noexcept;
  /// No more readings and poses will come.
  void finish() noexcept;

  /// Poses that the INS had a place for.
  [[nodiscard]] std::uint64_t matches() const noexcept { return matches_; }
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;
  /// `mount_source`: where the mount of the options is from.
  [[nodiscard]] EnuMetrics earth(const std::string& mount_source) const;

 private:
  void measure_way(const ComparedPose& pose) noexcept;
  void measure_errors(const ComparedPose& pose) noexcept;
  void apply_enu_alignment(Stamp stamp) noexcept;
  const Transform T_ins_left_;
  Comparison comparison_;
  EventLog& event_log_;
  InsEvents events_;
  SessionOutput* output_ = nullptr;
  std::array<FrameReport, Comparison::kPending> pending_{};  // by the count of their poses
  std::uint64_t added_ = 0, drained_ = 0;
  std::uint64_t matches_ = 0, scale_disagreements_ = 0;
  std::uint32_t alignment_revision_ = 0;
  std::vector<EnuAlignmentRecord> alignments_;  // its memory is taken at construction
  EnuErrors errors_{};                          // means and roots are squares' sums until earth()
  std::uint64_t heights_ = 0;                   // poses whose error upwards is in errors_
  bool on_way_ = false;                         // last_place_ means something
  Vec2 last_place_ = Vec2::Zero();              // where the newest whole step of the way ended
  double beyond_ = 0;                           // m from there to the newest place
  Stamp newest_stamp_{};
};

}  // namespace vergence::app
