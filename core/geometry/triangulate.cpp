#include "core/geometry/triangulate.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"

namespace vergence {
namespace {

// Minimum h_z, which is 1 in the first view; smaller values are rays nearly orthogonal to the
// camera's axis.
constexpr double kMinForward = 1e-6;
// Convergence limit of the ray, in rad.
constexpr double kConverged = 1e-12;
// Minimum of Σ (∂ray/∂ρ)² in m²; below it the cameras are within nanometres.
constexpr double kMinParallaxGain = 1e-18;

// Maximum number of Gauss–Newton steps; two or three are usual.
constexpr int kMaxSteps = 5;
// Minimum ratio of the inverse depth to its sigma.
constexpr double kMinSignificance = 3;

struct Reduced {
  Mat3 H;
  Vec3 g;
  double chi2;
};

[[nodiscard]] bool valid(std::span<const RayView> views) noexcept {
  if (views.size() < 2) return false;
  return std::all_of(views.begin(), views.end(), [](const RayView& v) noexcept {
    return v.T_camera_world.finite() && v.ray.allFinite() && v.sigma > 0 && std::isfinite(v.sigma);
  });
}

/// Computes T_view_first.
[[nodiscard]] Transform relative(const RayView& view, const RayView& first) noexcept {
  const Mat3 R = view.T_camera_world.R * first.T_camera_world.R.transpose();
  return {R, view.T_camera_world.t - R * first.T_camera_world.t};
}

/// Computes the normal equations. Returns false if the point is beside or behind a view.
[[nodiscard]] bool reduce(std::span<const RayView> views, const Vec3& abr, Reduced* out) noexcept {
  *out = {Mat3::Zero(), Vec3::Zero(), 0.0};
  for (const RayView& v : views) {
    const Transform T = relative(v, views.front());
    const Vec3 h = T.R * Vec3(abr[0], abr[1], 1.0) + abr[2] * T.t;
    if (!(h.z() > kMinForward)) return false;
    const double iz = 1.0 / h.z(), x = h.x() * iz, y = h.y() * iz;
    // ∂h/∂(a, b, ρ).
    Mat3 dh;
    dh << T.R.col(0), T.R.col(1), T.t;
    Mat23 J;
    J.row(0) = iz * (dh.row(0) - x * dh.row(2));
    J.row(1) = iz * (dh.row(1) - y * dh.row(2));
    const Vec2 r = v.ray - Vec2(x, y);
    const double w = 1.0 / (v.sigma * v.sigma);
    out->H.noalias() += w * J.transpose() * J;
    out->g.noalias() += w * J.transpose() * r;
    out->chi2 += w * r.squaredNorm();
  }
  return true;
}

/// Weighted least squares of ρ with (a, b) from the first view. Returns false if no view determines
/// it.
[[nodiscard]] bool linear_inverse_depth(std::span<const RayView> views, double* rho) noexcept {
  const RayView& first = views.front();
  double num = 0, den = 0, gain = 0;
  for (const RayView& v : views.subspan(1)) {
    const Transform T = relative(v, first);
    const Vec3 m = T.R * Vec3(first.ray.x(), first.ray.y(), 1.0);
    const double scale = 1.0 / (v.sigma * std::max(std::abs(m.z()), kMinForward));
    // The equation is x (m_z + ρ t_z) = m_x + ρ t_x, likewise for y.
    const Vec2 a = (v.ray * T.t.z() - T.t.head<2>()) * scale,
               b = (m.head<2>() - v.ray * m.z()) * scale;
    num += a.dot(b);
    den += a.squaredNorm();
    gain += a.squaredNorm() * v.sigma * v.sigma;
  }
  if (!(gain > kMinParallaxGain)) return false;
  *rho = num / den;
  return std::isfinite(*rho);
}

}  // namespace

TriangulatedPoint triangulate(std::span<const RayView> views) noexcept {
  TriangulatedPoint out;
  if (!valid(views)) return out;
  const RayView& first = views.front();
  Vec3 abr(first.ray.x(), first.ray.y(), 0.0);
  if (!linear_inverse_depth(views, &abr[2])) {
    out.status = TriangulateStatus::no_baseline;
    return out;
  }
  Reduced now;
  if (!reduce(views, abr, &now)) {
    out.status = TriangulateStatus::behind;
    out.inverse_depth = abr[2];
    return out;
  }
  for (int step = 0; step < kMaxSteps; ++step) {
    const Cholesky<3> llt(now.H);
    if (!llt.ok()) break;
    const Vec3 delta = llt.solve(now.g);
    const Vec3 next = abr + delta;
    Reduced then;
    // Stop if a step does not lower the error: rounding, or a point that no depth explains.
    if (!next.allFinite() || !reduce(views, next, &then) || !(then.chi2 <= now.chi2)) break;
    abr = next;
    now = then;
    if (delta.norm() < kConverged) break;
  }
  const Cholesky<3> llt(now.H);
  const Mat3 S = llt.ok() ? llt.inverse() : Mat3(Mat3::Zero());
  if (!llt.ok() || !S.allFinite() || !(S(2, 2) > 0)) {
    out.status = TriangulateStatus::no_baseline;
    return out;
  }
  out.inverse_depth = abr[2];
  out.inverse_depth_sigma = std::sqrt(S(2, 2));
  const double rho = abr[2], sigma = out.inverse_depth_sigma;
  if (rho < -kMinSignificance * sigma) {
    out.status = TriangulateStatus::behind;
    return out;
  }
  const Transform T_world_first = first.T_camera_world.inverse();
  if (rho < kMinSignificance * sigma) {
    out.status = TriangulateStatus::no_parallax;
    out.p_world = T_world_first *
                  Vec3(Vec3(abr[0], abr[1], 1.0) / (std::max(rho, 0.0) + kMinSignificance * sigma));
    return out;
  }
  out.status = TriangulateStatus::ok;
  const double d = 1.0 / rho;
  out.p_world = T_world_first * Vec3(abr[0] * d, abr[1] * d, d);
  return out;
}

}  // namespace vergence
