#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"
#include "core/types/time.hpp"

/// Errors of an estimated trajectory relative to a reference, as in the literature.
///
/// Trajectories  Strictly ascending stamps, finite poses (precondition, asserted; the readers
///               reject other files). Estimate and reference are of the same point and axes of the
///               body; their worlds may differ by a rigid motion.
/// Threads       Pure functions. They allocate; not for the real-time path.
/// Units         Metres, radians, ratios (1 is 100 %). Scale is reported, and applied only if an
///               option selects it.
/// Errors        A status by value. A metric that does not exist (no segment of that length) is
///               NaN.
/// Sources       Umeyama 1991 (alignment); Sturm et al. 2012 (ATE); the KITTI odometry devkit
///               (segments).
namespace vergence {

enum class Association : std::uint8_t {
  /// Interpolates at the estimate's stamp: position linearly, rotation by slerp.
  interpolate,
  /// Uses the nearest reference pose in time.
  nearest,
};

/// Axes of the body whose heading is compared.
enum class BodyAxes : std::uint8_t {
  /// x right, y down, z forward.
  camera,
  /// x forward, y left, z up.
  forward_left_up,
};

/// Options of one table of KITTI segment errors.
struct SegmentOptions {
  /// Segment lengths in m, > 0.
  std::vector<double> lengths{100, 200, 300, 400, 500, 600, 700, 800};
  /// A segment begins at every step-th matched pose; > 0.
  int step = 10;
  /// True: multiply the estimate's positions by the Sim(3) scale first.
  bool scaled = false;
};

struct EvaluationOptions {
  Association association = Association::interpolate;
  /// With `interpolate`, the maximum gap of the reference that is interpolated.
  Duration max_gap = Duration::milliseconds(200);
  /// With `nearest`, the maximum difference of stamps of a match.
  Duration max_difference = Duration::milliseconds(5);
  BodyAxes axes = BodyAxes::camera;
  std::vector<SegmentOptions> segments{SegmentOptions{}};
};

/// Poses of both at the same times, in order: estimate[i] belongs to reference[i]. Stamps are the
/// estimate's.
struct MatchedTrajectories {
  std::vector<StampedPose> estimate;
  std::vector<StampedPose> reference;
  /// Number of estimates before the reference.
  std::size_t before = 0;
  /// Number of estimates after the reference.
  std::size_t after = 0;
  /// Number of estimates in a gap of the reference, or without a near enough neighbour.
  std::size_t gap = 0;
};

/// reference ≈ scale · R · estimate + t, least squares over positions, det R = +1.
struct Alignment {
  Mat3 R_reference_estimate = Mat3::Identity();
  /// In metres.
  Vec3 t_reference_estimate = Vec3::Zero();
  double scale = 1.0;
  /// Root mean square extent of the path across its main direction, in m: square root of the second
  /// singular value of the cross-covariance.
  double lateral_extent = 0.0;
  /// True if the path is so straight that positions do not determine the rotation about it;
  /// rotation and heading after this fit are then meaningless.
  bool roll_unobservable = false;
};

struct ErrorStatistics {
  /// The median of an even number of values is the mean of the middle two.
  double rmse = 0, mean = 0, median = 0, max = 0;
};

/// Signed heading errors, estimate − reference, positive counter-clockwise seen from above, each in
/// (−π, π], in rad.
struct HeadingErrors {
  double rms = 0, mean = 0, max_abs = 0, last = 0;
};

struct LengthError {
  /// Nominal length, in m.
  double length = 0;
  std::size_t count = 0;
  /// Ratio to the nominal length.
  double translation = std::numeric_limits<double>::quiet_NaN();
  /// In rad/m.
  double rotation = std::numeric_limits<double>::quiet_NaN();
};

struct SegmentErrors {
  int step = 0;
  std::vector<LengthError> per_length;
  /// Number of segments of all lengths; 0 if the path is shorter than every length.
  std::size_t count = 0;
  /// Mean over all segments, not over the lengths' means.
  double translation = std::numeric_limits<double>::quiet_NaN();
  /// In rad/m.
  double rotation = std::numeric_limits<double>::quiet_NaN();
};

enum class EvaluationStatus : std::uint8_t {
  ok,
  /// No estimate has a reference at its time.
  no_match,
  /// There are fewer than three matched poses.
  too_few,
  /// The matched positions of one of the two are all equal.
  no_motion,
};

/// All results that `evaluate` and summary.json report. Unless `status` is ok only the counts are
/// valid.
struct TrajectoryEvaluation {
  EvaluationStatus status = EvaluationStatus::no_match;
  std::size_t matched = 0;
  /// See MatchedTrajectories.
  std::size_t before = 0, after = 0, gap = 0;

  /// Path lengths in m over the matched poses, with straight lines across gaps.
  double path_reference = 0;
  double path_estimate = 0;
  /// Ratio estimate / reference.
  double path_ratio = 0;

  Alignment se3;
  Alignment sim3;
  /// Absolute trajectory errors, in m.
  ErrorStatistics ate_se3;
  ErrorStatistics ate_sim3;
  ErrorStatistics ate_unaligned;

  /// Up direction of the reference's world, about which headings are measured.
  Vec3 up_world = Vec3::UnitZ();
  /// Heading errors after the SE(3) alignment.
  HeadingErrors heading_se3;
  /// Heading errors after aligning the first matched poses.
  HeadingErrors heading_start_aligned;
  /// Angle of the whole rotation error, in rad.
  ErrorStatistics rotation_se3;

  /// Errors of the last matched pose: in m, in m, as a ratio to path_reference, and in rad.
  double end_error_se3 = 0;
  double end_error_start_aligned = 0;
  double end_error_ratio = 0;
  double end_rotation_start_aligned = 0;

  /// One for each SegmentOptions, in the same order.
  std::vector<SegmentErrors> segments;
};

/// Computes all results. Trajectories without overlap give a status, not an error.
[[nodiscard]] TrajectoryEvaluation evaluate(std::span<const StampedPose> estimate,
                                            std::span<const StampedPose> reference,
                                            const EvaluationOptions& options);

[[nodiscard]] MatchedTrajectories associate(std::span<const StampedPose> estimate,
                                            std::span<const StampedPose> reference,
                                            const EvaluationOptions& options);

enum class AlignmentScale : std::uint8_t { one, free };

/// Closed form of Horn and Umeyama. Precondition: as many estimates as references, at least one. If
/// all points coincide, R = I.
[[nodiscard]] Alignment align(std::span<const StampedPose> estimate,
                              std::span<const StampedPose> reference, AlignmentScale scale);

/// Path length Σ‖x_(i+1) − x_i‖, in m.
[[nodiscard]] double path_length(std::span<const StampedPose> trajectory);

/// `estimate_scale` multiplies the estimate's translations. Precondition: matched trajectories.
[[nodiscard]] SegmentErrors segment_errors(std::span<const StampedPose> estimate,
                                           std::span<const StampedPose> reference,
                                           const SegmentOptions& options,
                                           double estimate_scale = 1.0);

/// Up direction of the body's world: +z (enu, laser trackers) or −y (a camera's world), whichever
/// is nearer to the body's mean up.
[[nodiscard]] Vec3 world_up(std::span<const StampedPose> reference, BodyAxes axes);

}  // namespace vergence
