#pragma once
#include <nlohmann/json_fwd.hpp>

#include "app/session/event_log.hpp"
#include "core/math/se3.hpp"

namespace vergence::app {

/// INS-to-camera extrinsics and where they were read.
[[nodiscard]] nlohmann::ordered_json ins_mount_json(const Transform& T_ins_left,
                                                    const std::string& source);

enum class InsSource : std::uint8_t { device, recording };

/// Compares a session with its live or recorded INS pose by pose, passes the results to the
/// recorder and reports events, each once per change.
///
/// Runs on the estimator's thread, which is sealed; no synchronisation is needed after joining it.
/// Memory is from the arena. Samples and poses are added in order of arrival; every add() of a pose
/// is followed by drain().
class InsComparison {
 public:
  /// Maximum number of alignments kept for the files at the end; later ones are only in poses.csv
  /// and counted.
  static constexpr std::size_t kMaxPlacements = 4096;

  /// `event_log` must outlive this object.
  InsComparison(const ComparisonOptions& options, InsSource source, Arena& arena,
                EventLog& event_log);

  /// Call before the first add(). `output` must outlive the last one; its recorder needs
  /// Recorder::Options::ins.
  void open(SessionOutput* output) noexcept { output_ = output; }
  void add(const InsRecord& reading) noexcept;
  void add(const FrameReport& report) noexcept;
  /// Passes on every pose whose samples have arrived.
  void drain() noexcept;
  /// Called when no more samples and poses follow.
  void finish() noexcept;

  /// Number of poses with an INS position.
  [[nodiscard]] std::uint64_t matches() const noexcept { return matches_; }
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;
  /// The block `enu` of summary.json: position on the earth, and errors against the INS. Null if
  /// the INS never had a fix. `mount_source` is the origin of the INS extrinsics in the options.
  [[nodiscard]] nlohmann::ordered_json enu_json(const std::string& mount_source) const;

 private:
  void measure_way(const ComparedPose& pose) noexcept;
  void measure_errors(const ComparedPose& pose) noexcept;
  void apply_enu_alignment(Stamp stamp) noexcept;
  void record_sample(const InsSample& sample) noexcept;
  void record_match(const ComparedPose& pose) noexcept;
  void record_scale(const ComparedPose& pose) noexcept;

  const Transform T_ins_left_;
  const double scale_stretch_m_;
  const InsSource source_;
  Comparison comparison_;
  EventLog& event_log_;
  SessionOutput* output_ = nullptr;
  // Events that are reported once, or again when they have changed.
  bool attitude_reported_ = false, contradiction_reported_ = false, scale_disagrees_ = false;
  std::uint64_t jumps_ = 0;
  InsMatch last_match_ = InsMatch::ok;
  // Number of consecutive poses with that result.
  std::uint64_t match_run_ = 0;
  // Indexed by the count of poses.
  std::array<FrameReport, Comparison::kPending> pending_{};
  std::uint64_t added_ = 0, drained_ = 0;
  std::uint64_t matches_ = 0, scale_disagreements_ = 0;
  std::uint32_t alignment_revision_ = 0;
  // Alignments and the stamps from which they apply. Allocated at construction.
  std::vector<std::pair<Stamp, EnuAlignment>> alignments_;
  // Errors against the INS after the alignment, over the compared poses: sums of squares, maxima
  // and the newest values. Headings are clockwise.
  struct {
    std::uint64_t poses = 0, heights = 0;
    double horizontal_m2 = 0, horizontal_max_m = 0, horizontal_end_m = 0;
    double up_m2 = 0, up_end_m = 0;
    double heading_deg2 = 0, heading_max_deg = 0, heading_end_deg = 0;
  } errors_;
  // Horizontal path length of the INS from its first fix on, straight across gaps.
  double ins_path_m_ = 0;
  // True if last_place_ is valid.
  bool on_way_ = false;
  // End of the newest complete step of the path.
  Vec2 last_place_ = Vec2::Zero();
  // Distance in m from there to the newest position.
  double beyond_ = 0;
  Stamp newest_stamp_{};
};

}  // namespace vergence::app
