#include "core/comparison/detail/pose_interpolation.hpp"

#include <algorithm>

#include "core/math/so3.hpp"

namespace vergence::detail {
namespace {

/// Slope at the end of an interval from its two neighbours, weighted to be exact for a parabola.
Vec3 slope(const Vec3& before, double span_before, const Vec3& after, double span_after) {
  return (span_after / span_before * before + span_before / span_after * after) /
         (span_before + span_after);
}

/// Cubic Hermite interpolation from 0 at u = 0 to `whole` at u = 1, with the slopes per interval.
Vec3 hermite(double u, const Vec3& whole, const Vec3& slope_begin, const Vec3& slope_end) {
  const double v = 1 - u;
  return u * v * v * slope_begin - u * u * v * slope_end + u * u * (3 - 2 * u) * whole;
}

}  // namespace

bool pose_at(std::span<const StampedPose> trajectory, Stamp at, Duration max_gap, Transform* out) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), at,
                                      [](const StampedPose& e, Stamp t) { return e.stamp < t; });
  if (after == trajectory.end() || after == trajectory.begin()) return false;
  const StampedPose &a = *(after - 1), &b = *after;
  const Duration span = b.stamp - a.stamp;
  if (span > max_gap) return false;
  const double h = span.to_seconds(), u = (at - a.stamp).to_seconds() / h;
  const Mat3& R_a = a.T_world_body.R;
  const Vec3 step = b.T_world_body.t - a.T_world_body.t,
             turn = log_so3(R_a.transpose() * b.T_world_body.R);
  Vec3 step_begin = step, step_end = step, turn_begin = turn, turn_end = turn;
  if (after - 1 != trajectory.begin() && a.stamp - (after - 2)->stamp <= max_gap) {
    const StampedPose& p = *(after - 2);
    const double g = (a.stamp - p.stamp).to_seconds();
    step_begin = h * slope(a.T_world_body.t - p.T_world_body.t, g, step, h);
    turn_begin = h * slope(log_so3(p.T_world_body.R.transpose() * R_a), g, turn, h);
  }
  if (after + 1 != trajectory.end() && (after + 1)->stamp - b.stamp <= max_gap) {
    const StampedPose& n = *(after + 1);
    const double g = (n.stamp - b.stamp).to_seconds();
    step_end = h * slope(step, h, n.T_world_body.t - b.T_world_body.t, g);
    turn_end = h * slope(turn, h, log_so3(b.T_world_body.R.transpose() * n.T_world_body.R), g);
  }
  out->R = R_a * exp_so3(hermite(u, turn, turn_begin, turn_end));
  out->t = a.T_world_body.t + hermite(u, step, step_begin, step_end);
  return true;
}

}  // namespace vergence::detail
