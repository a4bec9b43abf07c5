#include "core/comparison/trajectory_metrics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/math/linear_solve.hpp"

namespace vergence {
namespace {

// Maximum uncertainty in rad of a rotation about the direction of travel that is worth comparing.
constexpr double kMaxRollUncertainty = 0.1;
// Minimum ratio of extents; below it the path is straight up to rounding.
constexpr double kStraight = 1e-6;

[[maybe_unused]] bool ascending(std::span<const StampedPose> poses) {
  return std::adjacent_find(poses.begin(), poses.end(),
                            [](const StampedPose& a, const StampedPose& b) {
                              return !(a.stamp < b.stamp);
                            }) == poses.end();
}

bool earlier(Stamp stamp, const StampedPose& pose) { return stamp < pose.stamp; }

/// Computes the reference at a stamp within its span. Returns false in a gap.
bool reference_at(Stamp stamp, std::span<const StampedPose> reference,
                  const EvaluationOptions& options, Transform* T) {
  const auto next = std::upper_bound(reference.begin(), reference.end(), stamp, earlier);
  const StampedPose& left = *(next - 1);
  if (options.association == Association::interpolate) {
    if (left.stamp == stamp) {
      *T = left.T_world_body;
      return true;
    }
    const Duration interval = next->stamp - left.stamp;
    if (interval > options.max_gap) return false;
    const double s =
        static_cast<double>((stamp - left.stamp).ns()) / static_cast<double>(interval.ns());
    *T = interpolate(left.T_world_body, next->T_world_body, s);
    return true;
  }
  const bool right_is_nearer = next != reference.end() && next->stamp - stamp < stamp - left.stamp;
  const StampedPose& nearest = right_is_nearer ? *next : left;
  const Duration difference = right_is_nearer ? next->stamp - stamp : stamp - left.stamp;
  *T = nearest.T_world_body;
  return difference <= options.max_difference;
}

ErrorStatistics statistics(std::vector<double> errors) {
  ErrorStatistics s;
  if (errors.empty()) return s;
  std::sort(errors.begin(), errors.end());
  const std::size_t n = errors.size();
  double sum = 0, squares = 0;
  for (const double e : errors) {
    sum += e;
    squares += e * e;
  }
  s.mean = sum / static_cast<double>(n);
  s.rmse = std::sqrt(squares / static_cast<double>(n));
  s.median = n % 2 == 1 ? errors[n / 2] : 0.5 * (errors[n / 2 - 1] + errors[n / 2]);
  s.max = errors.back();
  return s;
}

std::vector<double> position_errors(const MatchedTrajectories& m, const Alignment& a) {
  std::vector<double> errors(m.estimate.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const Vec3 aligned =
        a.scale * (a.R_reference_estimate * m.estimate[i].T_world_body.t) + a.t_reference_estimate;
    errors[i] = (m.reference[i].T_world_body.t - aligned).norm();
  }
  return errors;
}

HeadingErrors heading_errors(const MatchedTrajectories& m, const Mat3& R, BodyAxes axes,
                             const Vec3& up) {
  const Vec3 forward = axes == BodyAxes::camera ? Vec3(Vec3::UnitZ()) : Vec3(Vec3::UnitX());
  HeadingErrors h;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < m.estimate.size(); ++i) {
    const Vec3 f_estimate = R * (m.estimate[i].T_world_body.R * forward);
    const Vec3 f_reference = m.reference[i].T_world_body.R * forward;
    // Project both directions to the plane orthogonal to `up`; atan2 gives the signed angle in (−π,
    // π].
    const Vec3 e = f_estimate - up.dot(f_estimate) * up;
    const Vec3 r = f_reference - up.dot(f_reference) * up;
    const double error = std::atan2(up.dot(r.cross(e)), r.dot(e));
    sum += error;
    squares += error * error;
    h.max_abs = std::max(h.max_abs, std::abs(error));
    h.last = error;
  }
  const auto n = static_cast<double>(m.estimate.size());
  h.mean = sum / n;
  h.rms = std::sqrt(squares / n);
  return h;
}

ErrorStatistics rotation_errors(const MatchedTrajectories& m, const Mat3& R) {
  std::vector<double> errors(m.estimate.size());
  for (std::size_t i = 0; i < errors.size(); ++i)
    errors[i] = rotation_angle(m.reference[i].T_world_body.R.transpose() * R *
                               m.estimate[i].T_world_body.R);
  return statistics(std::move(errors));
}

void end_errors(const MatchedTrajectories& m, TrajectoryEvaluation* out) {
  const Transform relative_reference =
      m.reference.front().T_world_body.inverse() * m.reference.back().T_world_body;
  const Transform relative_estimate =
      m.estimate.front().T_world_body.inverse() * m.estimate.back().T_world_body;
  const Transform E = relative_reference.inverse() * relative_estimate;
  out->end_error_start_aligned = E.t.norm();
  out->end_error_ratio = out->end_error_start_aligned / out->path_reference;
  out->end_rotation_start_aligned = rotation_angle(E.R);
}

bool moves(std::span<const StampedPose> poses) {
  return std::any_of(poses.begin(), poses.end(), [&](const StampedPose& p) {
    return p.T_world_body.t != poses.front().T_world_body.t;
  });
}

}  // namespace

MatchedTrajectories associate(std::span<const StampedPose> estimate,
                              std::span<const StampedPose> reference,
                              const EvaluationOptions& options) {
  assert(ascending(estimate) && ascending(reference));
  MatchedTrajectories m;
  if (reference.empty()) return m;
  m.estimate.reserve(estimate.size());
  m.reference.reserve(estimate.size());
  const Stamp first = reference.front().stamp, last = reference.back().stamp;
  // A reference pose within max_difference is also a match just outside the reference's span.
  const Duration margin =
      options.association == Association::nearest ? options.max_difference : Duration{};
  for (const StampedPose& pose : estimate) {
    if (pose.stamp < first - margin) {
      ++m.before;
    } else if (pose.stamp > last + margin) {
      ++m.after;
    } else {
      Transform T = reference.front().T_world_body;
      if (pose.stamp >= first && !reference_at(pose.stamp, reference, options, &T)) {
        ++m.gap;
        continue;
      }
      m.estimate.push_back(pose);
      m.reference.push_back({pose.stamp, T});
    }
  }
  return m;
}

Alignment align(std::span<const StampedPose> estimate, std::span<const StampedPose> reference,
                AlignmentScale scale) {
  assert(estimate.size() == reference.size() && !estimate.empty());
  const std::size_t count = estimate.size();
  const auto n = static_cast<double>(count);
  Vec3 mean_e = Vec3::Zero(), mean_r = Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    mean_e += estimate[i].T_world_body.t;
    mean_r += reference[i].T_world_body.t;
  }
  mean_e /= n;
  mean_r /= n;
  Mat3 covariance = Mat3::Zero();
  double variance_e = 0, variance_r = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 e = estimate[i].T_world_body.t - mean_e, r = reference[i].T_world_body.t - mean_r;
    covariance += r * e.transpose();
    variance_e += e.squaredNorm();
    variance_r += r.squaredNorm();
  }
  covariance /= n;
  variance_e /= n;
  variance_r /= n;

  Alignment a;
  if (variance_e > 0 && variance_r > 0) {
    const Svd3 s = svd(covariance);
    // If the best fit is a reflection, flip the weakest direction.
    Vec3 sign = Vec3::Ones();
    if (s.U.determinant() * s.V.determinant() < 0) sign.z() = -1.0;
    a.R_reference_estimate = s.U * sign.asDiagonal() * s.V.transpose();
    const double trace = s.singular.dot(sign);
    if (scale == AlignmentScale::free) a.scale = trace / variance_e;
    a.lateral_extent = std::sqrt(s.singular[1]);
    // A roll about the main direction moves offsets along the second direction into the third. The
    // residual there over the lever arm is about the uncertainty of the roll.
    const Vec3 third = s.U.col(2);
    double squares = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 e = estimate[i].T_world_body.t - mean_e, r = reference[i].T_world_body.t - mean_r;
      const double residual = third.dot(r - a.scale * (a.R_reference_estimate * e));
      squares += residual * residual;
    }
    const double main_extent = std::sqrt(s.singular[0]);
    a.roll_unobservable = !(std::sqrt(squares / n) < kMaxRollUncertainty * a.lateral_extent &&
                            a.lateral_extent > kStraight * main_extent);
  } else {
    a.roll_unobservable = true;
  }
  a.t_reference_estimate = mean_r - a.scale * (a.R_reference_estimate * mean_e);
  return a;
}

double path_length(std::span<const StampedPose> trajectory) {
  double length = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    length += (trajectory[i].T_world_body.t - trajectory[i - 1].T_world_body.t).norm();
  return length;
}

Vec3 world_up(std::span<const StampedPose> reference, BodyAxes axes) {
  Vec3 mean = Vec3::Zero();
  for (const StampedPose& pose : reference)
    mean += axes == BodyAxes::camera ? Vec3(-pose.T_world_body.R.col(1))
                                     : Vec3(pose.T_world_body.R.col(2));
  return -mean.y() > mean.z() ? Vec3(-Vec3::UnitY()) : Vec3(Vec3::UnitZ());
}

TrajectoryEvaluation evaluate(std::span<const StampedPose> estimate,
                              std::span<const StampedPose> reference,
                              const EvaluationOptions& options) {
  const MatchedTrajectories m = associate(estimate, reference, options);
  TrajectoryEvaluation out;
  out.matched = m.estimate.size();
  out.before = m.before;
  out.after = m.after;
  out.gap = m.gap;
  // Minimum number of positions that determine a rotation.
  constexpr std::size_t kMin = 3;
  out.status = out.matched == 0                             ? EvaluationStatus::no_match
               : out.matched < kMin                         ? EvaluationStatus::too_few
               : !(moves(m.estimate) && moves(m.reference)) ? EvaluationStatus::no_motion
                                                            : EvaluationStatus::ok;
  if (out.status != EvaluationStatus::ok) return out;

  out.path_reference = path_length(m.reference);
  out.path_estimate = path_length(m.estimate);
  out.path_ratio = out.path_estimate / out.path_reference;

  out.se3 = align(m.estimate, m.reference, AlignmentScale::one);
  out.sim3 = align(m.estimate, m.reference, AlignmentScale::free);
  const std::vector<double> aligned = position_errors(m, out.se3);
  out.end_error_se3 = aligned.back();
  out.ate_se3 = statistics(aligned);
  out.ate_sim3 = statistics(position_errors(m, out.sim3));
  out.ate_unaligned = statistics(position_errors(m, Alignment{}));

  out.up_world = world_up(m.reference, options.axes);
  const Mat3 R_start =
      m.reference.front().T_world_body.R * m.estimate.front().T_world_body.R.transpose();
  out.heading_start_aligned = heading_errors(m, R_start, options.axes, out.up_world);
  out.heading_se3 = heading_errors(m, out.se3.R_reference_estimate, options.axes, out.up_world);
  out.rotation_se3 = rotation_errors(m, out.se3.R_reference_estimate);
  end_errors(m, &out);

  for (const SegmentOptions& segments : options.segments)
    out.segments.push_back(
        segment_errors(m.estimate, m.reference, segments, segments.scaled ? out.sim3.scale : 1.0));
  return out;
}

}  // namespace vergence
