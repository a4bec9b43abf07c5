#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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
  /// p_ins = T_ins_left * p_left; made by mount_of() from the configuration's lever arm and
  /// boresight.
  Transform T_ins_left{};
  /// m driven with a valid fix, after which the alignment is fitted and frozen. > 0
  double alignment_distance_m = 100.0;
  /// s: for so long the INS's position errors resemble one another; sets the alignment's sigma. > 0
  double correlation_s = 10.0;
  /// Used where a sample gives no sigma of its own. > 0
  double position_sigma_m = 2.5;
  double height_sigma_m = 5.0;
  double tilt_sigma_rad = 0.0087;  // half a degree
  /// Sigma of the INS's heading including the mounting, for the alignment;
  /// 0: the heading is the positions' alone, as it must be where the INS-to-camera rotation is not
  /// known to a degree.
  double heading_sigma_rad = 0;
  /// Two samples farther apart than this are not interpolated between.
  Duration max_gap = Duration::milliseconds(100);
  /// A pose waits so long for the INS sample after it, by the stamps of the poses that follow; then
  /// it goes out without.
  Duration max_wait = Duration::milliseconds(500);
  /// m: a step from fix to fix beyond this and 60 m/s is a jump: not interpolated across.
  double jump_m = 20.0;
  /// m: path lengths are compared over the newest stretch of this length; `scale_disagrees` beyond
  /// `scale_tolerance` and 4 sigma.
  double scale_stretch_m = 200.0;
  double scale_tolerance = 0.02;
  /// INS samples held; the oldest goes. 8192 are 68 s at 120 Hz, far more than any pose waits.
  /// Power of two.
  std::size_t ins_capacity = 8192;
};

/// From where the left camera sits in the body of the INS (forward, left, up; m) and how the rig's
/// forward-left-up axes are turned against the INS's (roll, pitch, yaw, rad: R = Rz(yaw) Ry(pitch)
/// Rx(roll)). All zero: they look the same way.
[[nodiscard]] Transform mount_of(const Vec3& lever_arm_m, const Vec3& boresight_rad) noexcept;

/// The boresight that mount_of() makes this rotation of. At a pitch of ±90° roll and yaw are one
/// turn: roll is then the rounding's.
[[nodiscard]] Vec3 boresight_of(const Mat3& R_ins_left) noexcept;

/// INS state at a frame's stamp.
enum class InsMatch : std::uint8_t {
  ok,
  none,    // no sample yet, or none after the frame: late, gone
  gap,     // samples are missing around the frame
  no_fix,  // the receiver has no position: the comparison pauses
  jump,    // the position leapt around the frame
};
[[nodiscard]] const char* to_string(InsMatch) noexcept;

/// A place and a direction of the left camera on the earth.
struct EnuPose {
  Transform T_enu_left{};
  Geodetic position{};
  double yaw = 0;  // rad, of the camera's view in the horizontal plane, counter-clockwise from east
};

/// One frame with both. What is not there (`placed` or `ins_valid` false) is zero and means
/// nothing.
struct ComparedPose {
  PoseSample pose{};
  InsMatch ins = InsMatch::none;
  bool ins_valid = false;
  bool placed = false;    // the pose is not lost and there is a alignment
  bool compared = false;  // both: the errors mean something
  EnuPose ours{};
  EnuPose reference{};            // the INS brought to the left camera and to the frame's stamp
  double ins_position_sigma = 0;  // m, horizontal, each axis: the larger of the two samples'
                                  // around the frame
  bool height_known = false;      // the INS measured its height; else error_enu.z() is 0
  Vec3 error_enu = Vec3::Zero();  // m, ours − INS
  double error_yaw = 0;           // rad, in (−π, π], counter-clockwise from above positive
  /// Ours / INS over the newest scale_stretch_m that have both; 0: not yet that far. It and what
  /// its values stay while the INS is disconnected.
  double path_ratio = 0;
  bool scale_disagrees = false;
};

/// Counters; all only grow.
struct ComparisonCounters {
  std::uint64_t ins_samples = 0;
  std::uint64_t ins_refused = 0;  // out of order, not a number, not a place on the earth
  std::uint64_t ins_restarts =
      0;  // the INS's stamps went back for good: its history was begun again
  std::uint64_t ins_without_attitude = 0;  // compared by position and heading, taken as level
  std::uint64_t ins_contradicted = 0;  // likewise: their attitude did not go with the way driven
  std::uint64_t jumps = 0;
  std::uint64_t compared = 0;
  std::uint64_t without_ins = 0;  // poses that went out with an InsMatch other than ok
  std::uint64_t pushed_out = 0;  // poses that went out before their time because the queue was full
};

/// Our poses against a geodetic INS, frame by frame: interpolation, alignment on the earth, errors,
/// scale.
///
///     Arena arena(Comparison::bytes_needed(options));
///     Comparison comparison(options, arena);
///     comparison.add(reading);  // as they come
///     comparison.add(pose);
///     for (ComparedPose compared; comparison.next(&compared);)
///       if (compared.compared) use(compared.error_enu);
///
/// Ownership  Memory comes from the arena given at construction; nothing is taken later. Values in,
///            values out.
/// Threads    One thread calls everything. Rings bring samples and poses to it.
/// Memory     ins_capacity samples (the oldest goes), kPending poses (the oldest goes out at once,
///            counted), a fixed number of alignment pairs. An hour or a year makes no difference.
/// Time       Constant a call, but for the call that fits the alignment (linear in
/// EnuAlignmentBuilder::kPairs,
///            well under a millisecond).
/// Frames     `enu` has its origin at the first valid fix. `world` is the odometry's.
/// Errors     Nothing throws after construction. What is missing is said in each ComparedPose.
class Comparison {
 public:
  static constexpr std::size_t kPending = 64;

  /// Throws std::length_error when the arena is full.
  Comparison(const ComparisonOptions& options, Arena& arena);
  Comparison(const Comparison&) = delete;  // its parts refer to one another
  Comparison& operator=(const Comparison&) = delete;
  /// Free size that the arena must have.
  [[nodiscard]] static std::size_t bytes_needed(const ComparisonOptions& options) noexcept;

  /// Samples in order of their stamps; others are refused and counted.
  void add(const InsSample& sample) noexcept { ins_.add(sample); }
  /// Poses in order of their stamps, lost ones too. Precondition: next() was called until false
  /// since the last one, so there is room.
  void add(const PoseSample& pose) noexcept;
  /// The next pose that has met its INS samples, or will not any more. False: none yet, *out as it
  /// was. Call until false.
  [[nodiscard]] bool next(ComparedPose* out) noexcept;
  /// No more samples will come: everything pending goes out by next(), and a drive too short for
  /// the alignment is placed with what there is once the last has gone.
  void finish() noexcept { finishing_ = true; }

  /// revision 0: none yet.
  [[nodiscard]] const EnuAlignment& alignment() const noexcept { return builder_.alignment(); }
  [[nodiscard]] bool has_origin() const noexcept { return ins_.has_origin(); }
  [[nodiscard]] const LocalTangentPlane& plane() const noexcept { return ins_.plane(); }
  [[nodiscard]] const ComparisonCounters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] bool ready(const PoseSample& pose) const noexcept;
  [[nodiscard]] EnuPose in_enu(const Transform& T_enu_left) const;
  /// The pose is at the INS position: scale and alignment take it in.
  void take(const ComparedPose& c, const InsHistory::Reference& reference) noexcept;

  const ComparisonOptions options_;
  ComparisonCounters counters_{};
  InsHistory ins_;
  EnuAlignmentBuilder builder_;
  PathRatio ratio_;
  std::array<PoseSample, kPending> pending_{};
  std::uint64_t pending_begin_ = 0, pending_end_ = 0;
  bool finishing_ = false;
  bool flat_ = false;       // the newest reference had no height
  bool restarted_ = false;  // the newest pose was of a restarted scene
};

}  // namespace vergence
