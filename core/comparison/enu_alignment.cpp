#include "core/comparison/enu_alignment.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"

namespace vergence {
namespace {

// Maximum standard deviation of a heading in rad; it is larger at standstill or on a path much
// shorter than the receiver's error.
constexpr double kWorstHeading = 1.0;
// Maximum heading difference in rad of a measured INS-to-camera rotation.
constexpr double kNoMount = 0.1;
// Convergence limit in rad and m, a thousandth of any receiver's resolution.
constexpr double kConverged = 1e-9;

/// Initial rotation: mean of the attitudes' rotations, rotated about up to the heading by
/// positions, whatever the INS's heading.
Mat3 start(std::span<const EnuAlignmentPair> pairs, const Vec3& middle_world,
           const Vec3& middle_enu) noexcept {
  const Eigen::Quaterniond first(pairs.front().R_enu_world);
  Vec4 sum = Vec4::Zero();
  for (const EnuAlignmentPair& p : pairs) {
    const Eigen::Quaterniond q(p.R_enu_world);
    sum += q.dot(first) < 0 ? Vec4(-q.coeffs()) : Vec4(q.coeffs());
  }
  Eigen::Quaterniond mean;
  mean.coeffs() = sum.normalized();
  const Mat3 R = sum.norm() > 0 ? mean.toRotationMatrix() : pairs.front().R_enu_world;
  double along = 0, stereo = 0;
  for (const EnuAlignmentPair& p : pairs) {
    const Vec3 d = R * (p.p_world_left - middle_world), y = p.p_enu_left - middle_enu;
    along += d.x() * y.x() + d.y() * y.y();
    stereo += d.x() * y.y() - d.y() * y.x();
  }
  return exp_so3({0, 0, std::atan2(stereo, along)}) * R;
}

struct Normal {
  // Rotation φ (left, enu axes), then position of the middle.
  Mat6 H = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  // Σ of squared position residuals, in m² and over their variances.
  double squares = 0;
  double weighted = 0;
};

Normal normal_equations(std::span<const EnuAlignmentPair> pairs, const Mat3& R,
                        const Vec3& middle_world, const Vec3& middle_enu,
                        double independent) noexcept {
  Normal out;
  const auto n = static_cast<double>(pairs.size());
  for (const EnuAlignmentPair& p : pairs) {
    const Vec3 d = R * (p.p_world_left - middle_world);
    const Vec3 r = p.p_enu_left - middle_enu - d;
    const Vec3 sigma(p.position_sigma, p.position_sigma, p.height_sigma);
    const Vec3 w = (independent / n) * sigma.cwiseAbs2().cwiseInverse();
    // r(φ, τ) = y − (m + τ) − Exp(φ) d: ∂r/∂φ = [d]×, ∂r/∂τ = −I.
    Eigen::Matrix<double, 3, 6> J;
    J << skew(d), -Mat3::Identity();
    out.H += J.transpose() * w.asDiagonal() * J;
    out.g += J.transpose() * w.asDiagonal() * r;
    out.squares += r.squaredNorm();
    out.weighted += r.cwiseAbs2().dot(sigma.cwiseAbs2().cwiseInverse());

    // The world's up direction by the INS's attitude must point up after the alignment: r = (ẑ − R
    // v) in east and north.
    const Vec3 up = R * (p.R_enu_world.transpose() * Vec3::UnitZ());
    const Eigen::Matrix<double, 2, 3> J_tilt = skew(up).topRows<2>();
    const double w_tilt = 1.0 / (n * p.tilt_sigma * p.tilt_sigma);
    out.H.topLeftCorner<3, 3>() += w_tilt * J_tilt.transpose() * J_tilt;
    out.g.head<3>() -= w_tilt * J_tilt.transpose() * up.head<2>();

    // The remaining rotation of the attitude is about up: r(φ) = turn − φ_z. A large one means an
    // unknown INS-to-camera rotation.
    const double turn = log_so3(p.R_enu_world * R.transpose()).z();
    if (!(p.heading_sigma > 0) || std::abs(turn) > kNoMount) continue;
    const double w_heading = 1.0 / (n * p.heading_sigma * p.heading_sigma);
    out.H(2, 2) += w_heading;
    out.g[2] -= w_heading * turn;
  }
  return out;
}

}  // namespace

EnuAlignmentStatus fit_enu_alignment(std::span<const EnuAlignmentPair> pairs, Duration correlation,
                                     EnuAlignment* alignment) noexcept {
  if (pairs.size() < 3) return EnuAlignmentStatus::too_few;
  const auto n = static_cast<double>(pairs.size());
  Vec3 middle_world = Vec3::Zero(), middle_enu = Vec3::Zero();
  for (const EnuAlignmentPair& p : pairs) {
    middle_world += p.p_world_left / n;
    middle_enu += p.p_enu_left / n;
  }
  const double span = (pairs.back().stamp - pairs.front().stamp).to_seconds();
  const double independent = std::min(n, 1.0 + span / std::max(correlation.to_seconds(), 1e-3));

  Mat3 R = start(pairs, middle_world, middle_enu);
  Normal normal = normal_equations(pairs, R, middle_world, middle_enu, independent);
  for (int step = 0; step < kAlignmentSteps; ++step) {
    Vec6 delta;
    if (!ldlt_solve(normal.H, normal.g, &delta)) return EnuAlignmentStatus::not_held;
    delta = -delta;
    if (!delta.allFinite()) return EnuAlignmentStatus::not_held;
    R = normalised(exp_so3(delta.head<3>()) * R);
    middle_enu += delta.tail<3>();
    normal = normal_equations(pairs, R, middle_world, middle_enu, independent);
    if (delta.norm() < kConverged) break;
  }

  // Residuals larger than their sigmas widen the result; smaller ones do not narrow it, because
  // they share errors.
  const double excess = std::max(1.0, normal.weighted / (3.0 * n));
  const Mat6 covariance = excess * ldlt_inverse(normal.H);
  const Vec6 sigma = covariance.diagonal().cwiseSqrt();
  if (!sigma.allFinite() || !(sigma[2] < kWorstHeading)) return EnuAlignmentStatus::not_held;

  alignment->T_enu_world = {R, middle_enu - R * middle_world};
  alignment->rotation_sigma = sigma.head<3>();
  alignment->position_sigma = sigma.tail<3>();
  alignment->residual = std::sqrt(normal.squares / n);
  alignment->pairs = static_cast<int>(pairs.size());
  alignment->first = pairs.front().stamp;
  alignment->last = pairs.back().stamp;
  ++alignment->revision;
  return EnuAlignmentStatus::ok;
}

}  // namespace vergence
