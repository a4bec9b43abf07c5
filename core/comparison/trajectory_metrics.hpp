#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"
#include "core/types/time.hpp"

/// Errors of an estimated trajectory against a reference, as in the literature.
///
/// Trajectories  Strictly ascending stamps, finite poses (precondition, asserted; the readers
///               refuse other files). Body of estimate and reference is the same point and the same
///               axes; their worlds may differ by a rigid motion.
/// Threads       Pure functions. Memory: the heap; this is not for the real-time path.
/// Units         Metres, radians, ratios (1 is 100 %). Scale is reported, never applied but where
///               an option selects it.
/// Errors        A status by value. A figure that does not exist (no segment of that length) is
///               NaN, never zero.
/// Sources       Umeyama 1991 (alignment); Sturm et al. 2012 (ATE); the KITTI odometry devkit
///               (segments).
namespace vergence {

enum class Association : std::uint8_t {
  interpolate,  // the reference at the estimate's stamp: position linear, rotation by slerp
  nearest,      // the reference pose nearest in time, as it is
};

/// Axes of the body whose heading is compared.
enum class BodyAxes : std::uint8_t {
  camera,           // x right, y down, z forward
  forward_left_up,  // x forward, y left, z up
};

/// One table of KITTI segment errors.
struct SegmentOptions {
  std::vector<double> lengths{100, 200, 300, 400, 500, 600, 700, 800};  // m, > 0
  int step = 10;        // a segment begins at every step-th matched pose; > 0
  bool scaled = false;  // multiply the estimate's positions by the Sim(3) scale first
};

struct EvaluationOptions {
  Association association = Association::interpolate;
  Duration max_gap =
      Duration::milliseconds(200);  // interpolate: the widest hole of the reference that is bridged
  Duration max_difference =
      Duration::milliseconds(5);  // nearest: the largest difference of stamps that is a match
  BodyAxes axes = BodyAxes::camera;
  std::vector<SegmentOptions> segments{SegmentOptions{}};
};

/// Poses of both at the same times, in order: estimate[i] belongs to reference[i]. The stamps are
/// the estimate's.
struct MatchedTrajectories {
  std::vector<StampedPose> estimate;
  std::vector<StampedPose> reference;
  std::size_t before = 0;  // estimates left out: earlier than the reference
  std::size_t after = 0;   // … later than the reference
  std::size_t gap = 0;     // … in a hole of the reference, or without a neighbour near enough
};

/// reference ≈ scale · R · estimate + t, least squares over positions, det R = +1.
struct Alignment {
  Mat3 R_reference_estimate = Mat3::Identity();
  Vec3 t_reference_estimate = Vec3::Zero();  // m
  double scale = 1.0;
  /// Root mean square extent, m, of the path across its main direction: √ of the second singular
  /// value of the cross-covariance.
  double lateral_extent = 0.0;
  /// The path is so straight that positions do not hold the rotation about it: rotation and heading
  /// after this fit mean nothing.
  bool roll_unobservable = false;
};

struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0,
         max = 0;  // the median of an even number is the mean of the middle two
};

/// Signed heading errors, estimate − reference, counter-clockwise from above positive, each in (−π,
/// π].
struct HeadingErrors {
  double rms = 0, mean = 0, max_abs = 0, last = 0;  // rad
};

struct LengthError {
  double length = 0;                                              // m, nominal
  std::size_t count = 0;                                          // segments
  double translation = std::numeric_limits<double>::quiet_NaN();  // ratio to the nominal length
  double rotation = std::numeric_limits<double>::quiet_NaN();     // rad/m
};

struct SegmentErrors {
  int step = 0;
  std::vector<LengthError> per_length;  // in the order of the option
  std::size_t count = 0;  // of all lengths together; 0: the path is shorter than every length
  double translation = std::numeric_limits<double>::quiet_NaN();  // mean over all segments, not
                                                                  // over the lengths' means
  double rotation = std::numeric_limits<double>::quiet_NaN();     // rad/m
};

enum class EvaluationStatus : std::uint8_t {
  ok,
  no_match,   // no estimate has a reference at its time
  too_few,    // fewer than three matched poses: nothing to align
  no_motion,  // the matched positions of one of the two are all the same: nothing to align
};

/// Everything that `evaluate` and summary.json report. Unless `status` is ok only the counts mean
/// something.
struct TrajectoryEvaluation {
  EvaluationStatus status = EvaluationStatus::no_match;
  std::size_t matched = 0;
  std::size_t before = 0, after = 0, gap = 0;  // estimates left out, as in MatchedTrajectories

  double path_reference = 0;  // m, over the matched poses; holes bridged by a straight line
  double path_estimate = 0;   // m
  double path_ratio = 0;      // estimate / reference

  Alignment se3;            // scale 1
  Alignment sim3;           // its `scale` is the Sim(3) scale s
  ErrorStatistics ate_se3;  // m
  ErrorStatistics ate_sim3;
  ErrorStatistics ate_unaligned;

  Vec3 up_world = Vec3::UnitZ();        // up of the reference's world that headings are taken about
  HeadingErrors heading_se3;            // the estimate's rotations turned by se3
  HeadingErrors heading_start_aligned;  // the estimate moved so that its first matched pose is the
                                        // reference's
  ErrorStatistics rotation_se3;         // rad, whole rotation

  double end_error_se3 = 0;               // m, of the last matched pose
  double end_error_start_aligned = 0;     // m
  double end_error_ratio = 0;             // the same over path_reference
  double end_rotation_start_aligned = 0;  // rad

  std::vector<SegmentErrors> segments;  // one for each SegmentOptions, same order
};

/// All of it. Two trajectories without overlap are a status, not an error.
[[nodiscard]] TrajectoryEvaluation evaluate(std::span<const StampedPose> estimate,
                                            std::span<const StampedPose> reference,
                                            const EvaluationOptions& options);

/// The parts, for callers that need one of them.

[[nodiscard]] MatchedTrajectories associate(std::span<const StampedPose> estimate,
                                            std::span<const StampedPose> reference,
                                            const EvaluationOptions& options);

enum class AlignmentScale : std::uint8_t { one, free };

/// Closed form of Horn and Umeyama. Precondition: as many estimates as references, at least one.
/// Points that all coincide leave R = I.
[[nodiscard]] Alignment align(std::span<const StampedPose> estimate,
                              std::span<const StampedPose> reference, AlignmentScale scale);

/// Σ‖x_(i+1) − x_i‖, metres.
[[nodiscard]] double path_length(std::span<const StampedPose> trajectory);

/// `estimate_scale` multiplies the estimate's translations. Precondition: matched, i.e. of equal
/// size.
[[nodiscard]] SegmentErrors segment_errors(std::span<const StampedPose> estimate,
                                           std::span<const StampedPose> reference,
                                           const SegmentOptions& options,
                                           double estimate_scale = 1.0);

/// Up of the world a body moves in: +z (enu, laser trackers) or −y (a camera's world), whichever
/// the body's mean up is nearer to.
[[nodiscard]] Vec3 world_up(std::span<const StampedPose> reference, BodyAxes axes);

}  // namespace vergence
