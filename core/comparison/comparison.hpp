#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/comparison/enu_alignment_builder.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/comparison/ins_history.hpp"
#include "core/comparison/path_ratio.hpp"
#include "core/math/se3.hpp"
#include "core/memory/arena.hpp"
#include "core/types/ins_sample.hpp"
#include "core/types/pose_sample.hpp"

namespace vergence {

struct ComparisonOptions {
  /// p_ins = T_ins_left * p_left, from mount_of() with the configured lever arm and boresight.
  Transform T_ins_left{};
  /// Distance with a valid fix after which the alignment is fitted and frozen; > 0.
  double alignment_distance_m = 100.0;
  /// Correlation time of the INS's position errors, which determines the alignment's sigma; > 0.
  double correlation_s = 10.0;
  /// Standard deviations of samples without their own; > 0. The default tilt is half a degree.
  double position_sigma_m = 2.5;
  double height_sigma_m = 5.0;
  double tilt_sigma_rad = 0.0087;
  /// Standard deviation of the INS's heading including its mounting, for the alignment; 0 uses the
  /// positions only, as required if the INS-to-camera rotation is not known to a degree.
  double heading_sigma_rad = 0;
  /// Maximum gap between two samples that is interpolated.
  Duration max_gap = Duration::milliseconds(100);
  /// Maximum time that a pose waits for the next INS sample, by the stamps of later poses; after it
  /// the pose is output without INS.
  Duration max_wait = Duration::milliseconds(500);
  /// A step between fixes that exceeds this and 60 m/s is a jump and not interpolated.
  double jump_m = 20.0;
  /// Length of the newest stretch over which path lengths are compared; `scale_disagrees` if they
  /// differ by more than `scale_tolerance` and 4 sigma.
  double scale_stretch_m = 200.0;
  double scale_tolerance = 0.02;
  /// Capacity for INS samples, a power of two; the oldest is dropped. 8192 are 68 s at 120 Hz, far
  /// more than any pose waits.
  std::size_t ins_capacity = 8192;
};

/// Makes T_ins_left from the lever arm (the left camera's position in the INS body: forward, left,
/// up; m) and the boresight (rotation of the rig's forward-left-up axes relative to the INS's:
/// roll, pitch, yaw; rad; R = Rz(yaw) Ry(pitch) Rx(roll)).
[[nodiscard]] Transform mount_of(const Vec3& lever_arm_m, const Vec3& boresight_rad) noexcept;

/// Inverse of mount_of(): the boresight of a rotation. At a pitch of ±90° only the sum of roll and
/// yaw is determined.
[[nodiscard]] Vec3 boresight_of(const Mat3& R_ins_left) noexcept;

/// INS state at a frame's stamp.
enum class InsMatch : std::uint8_t {
  ok,
  /// There is no sample yet, or none after the frame.
  none,
  /// Samples are missing around the frame.
  gap,
  /// The receiver has no position, so the comparison pauses.
  no_fix,
  /// The position jumped around the frame.
  jump,
};
[[nodiscard]] const char* to_string(InsMatch) noexcept;

/// Position and direction of the left camera on the earth.
struct EnuPose {
  Transform T_enu_left{};
  Geodetic position{};
  /// Yaw of the optical axis in the horizontal plane, in rad counter-clockwise from east.
  double yaw = 0;
};

/// One frame with pose and INS. Fields that are not available (`placed` or `ins_valid` false) are
/// zero.
struct ComparedPose {
  PoseSample pose{};
  InsMatch ins = InsMatch::none;
  bool ins_valid = false;
  /// True if the pose is not lost and there is an alignment.
  bool placed = false;
  /// True if both are available, so that the errors are valid.
  bool compared = false;

  EnuPose estimate{};
  /// The INS pose converted to the left camera at the frame's stamp.
  EnuPose reference{};
  /// Horizontal standard deviation per axis in m, the larger of the two samples around the frame.
  double ins_position_sigma = 0;
  /// True if the INS measured its height; if not, error_enu.z() is 0.
  bool height_known = false;

  /// Difference estimate − INS, in m.
  Vec3 error_enu = Vec3::Zero();
  /// Yaw error in rad, in (−π, π], positive counter-clockwise seen from above.
  double error_yaw = 0;

  /// Ratio of the path lengths estimate / INS over the newest scale_stretch_m with both; 0 before.
  /// Keeps its value while the INS is disconnected.
  double path_ratio = 0;
  bool scale_disagrees = false;
};

/// Counters that only grow.
struct ComparisonCounters {
  std::uint64_t ins_samples = 0;
  /// Samples out of order, not finite or with an implausible position.
  std::uint64_t ins_refused = 0;
  /// Number of times that the INS's stamps went back permanently, so that its history was
  /// restarted.
  std::uint64_t ins_restarts = 0;
  /// Samples compared by position and heading, assumed level.
  std::uint64_t ins_without_attitude = 0;
  /// Samples treated likewise because their attitude contradicted the motion.
  std::uint64_t ins_contradicted = 0;
  std::uint64_t jumps = 0;
  std::uint64_t compared = 0;
  /// Poses output with an InsMatch other than ok.
  std::uint64_t without_ins = 0;
  /// Poses output early because the queue was full.
  std::uint64_t pushed_out = 0;
};

/// Compares poses with a geodetic INS, frame by frame: interpolation, ENU alignment, errors, scale.
///
///     Arena arena;
///     Comparison comparison(options, arena);
///     comparison.add(reading);  // in arrival order
///     comparison.add(pose);
///     for (ComparedPose compared; comparison.next(&compared);)
///       if (compared.compared) use(compared.error_enu);
///
/// Ownership  All memory is from the arena at construction. Values in, values out.
/// Threads    One caller.
/// Memory     ins_capacity samples (the oldest is dropped), kPending poses (the oldest is output
///            immediately and counted), and a fixed number of alignment pairs, for any duration.
/// Time       Constant per call, except for fitting the alignment (linear in
///            EnuAlignmentBuilder::kPairs, far below a millisecond).
/// Frames     `enu` has its origin at the first valid fix. `world` is the odometry's.
/// Errors     Nothing throws after construction. Each ComparedPose states what is missing.
class Comparison {
 public:
  static constexpr std::size_t kPending = 64;

  /// Throws std::length_error if the arena is full.
  Comparison(const ComparisonOptions& options, Arena& arena);
  /// Not copyable, because its parts refer to each other.
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;

  /// Adds a sample. Samples that are not in order of their stamps are rejected and counted.
  void add(const InsSample& sample) noexcept { ins_.add(sample); }
  /// Adds a pose, including lost ones, in order of stamps. Precondition: next() has returned false
  /// since the last one, so there is room.
  void add(const PoseSample& pose) noexcept;
  /// Outputs the next pose that has its INS samples or no longer waits for them. Returns false and
  /// leaves *out unchanged if there is none. Call until false.
  [[nodiscard]] bool next(ComparedPose* out) noexcept;
  /// Call after the last sample: next() then outputs all pending poses, and a run too short for the
  /// alignment is aligned with the available pairs at the end.
  void finish() noexcept { finishing_ = true; }

  /// The alignment; revision 0 if there is none yet.
  [[nodiscard]] const EnuAlignment& alignment() const noexcept { return builder_.alignment(); }
  [[nodiscard]] bool has_origin() const noexcept { return ins_.has_origin(); }
  [[nodiscard]] const LocalTangentPlane& plane() const noexcept { return ins_.plane(); }
  [[nodiscard]] const ComparisonCounters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] bool ready(const PoseSample& pose) const noexcept;
  [[nodiscard]] EnuPose in_enu(const Transform& T_enu_left) const;
  /// Adds a pose with an INS reference to scale and alignment.
  void take(const ComparedPose& c, const InsHistory::Reference& reference) noexcept;

  const ComparisonOptions options_;
  ComparisonCounters counters_{};
  InsHistory ins_;
  EnuAlignmentBuilder builder_;
  PathRatio ratio_;
  std::array<PoseSample, kPending> pending_{};
  std::uint64_t pending_begin_ = 0, pending_end_ = 0;
  bool finishing_ = false;
  // True if the newest reference had no height.
  bool flat_ = false;
  // True if the map was reset in the newest pose.
  bool restarted_ = false;
};

}  // namespace vergence
