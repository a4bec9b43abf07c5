#include "core/calibration/detail/monitor_residuals.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"
#include "core/math/robust.hpp"

namespace vergence::calibration::detail {
namespace {

constexpr int kStereoRounds =
    3;  // of reweighting: the scale falls from that of a knock to that of the noise in two
constexpr int kMotionRounds = 2;     // the odometry's motion is near, so fewer do
constexpr double kTukey3 = 6.0;      // as kTukey, for the length of three
constexpr double kMedian3 = 1.5382;  // of the length of three normals
constexpr double kMinScale = 0.1;    // of the sigma the observations claim
// An M-estimate's covariance has E ψ' where this code sums E w: (E w / E ψ')² for Gaussian errors
// at the constants above.
constexpr double kTukeySpread = 1.46, kTukeySpread3 = 1.27;
constexpr double kFitSigma =
    0.1;  // rad: prior that keeps a frame's own fit from running off where it sees nothing
constexpr double kMaxInverseDepth = 2;   // 1/m
constexpr int kMinMotionTracks = 12;     // six of the pose and something left to say
constexpr std::uint64_t kTrackGap = 30;  // frames: a number seen after longer is another track

using Mat36 = Eigen::Matrix<double, 3, 6>;

Vec2 ray(const Pinhole& k, const Vec2& pixel) noexcept {
  return {(pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy};
}

double tukey(double squared, double limit) noexcept {
  const double u = 1.0 - squared / (limit * limit);
  return u > 0 ? u * u : 0.0;
}

/// Where camera k sees the point now minus where it saw it a frame ago, px; q = (x, y, 1/Z) in the
/// left camera.
Vec2 image_motion(const Reference& c, const Vec3& q, const Transform& T_previous_now) noexcept {
  const Mat3& R = c.T_right_left.R;
  const Vec3& t = c.T_right_left.t;
  const Vec3 x(q.x(), q.y(), 1);
  const Vec3 now = R * x + q.z() * t;
  const Vec3 then = R * (T_previous_now.R * x + q.z() * T_previous_now.t) + q.z() * t;
  if (!(now.z() > 0.1 && then.z() > 0.1)) return Vec2::Zero();
  return {c.right.fx * (now.x() / now.z() - then.x() / then.z()),
          c.right.fy * (now.y() / now.z() - then.y() / then.z())};
}

double inverse_depth(const Reference& c, const Vec2& left, const Vec2& right) noexcept {
  double zl = 0, zr = 0;
  if (!match_depths(c.T_right_left, left, right, &zl, &zr)) return 0.0;
  return std::clamp(1.0 / zl, 0.0, kMaxInverseDepth);
}

/// A point from its two pixels by least squares in (x, y, 1/Z), one Gauss–Newton step from the two
/// rays' meeting.
struct Triangulated {
  Vec3 q;
  Mat3 information, covariance;  // for a sigma of 1 px
  Mat23 J_right;                 // ∂(right pixel)/∂q

  [[nodiscard]] bool from(const Reference& c, const Vec2& left, const Vec2& right) noexcept {
    const Vec2 l = ray(c.left, left), r = ray(c.right, right);
    const Mat3& R = c.T_right_left.R;
    const Vec3& t = c.T_right_left.t;
    q = {l.x(), l.y(), inverse_depth(c, l, r)};
    const Vec3 Y = R * Vec3(q.x(), q.y(), 1) + q.z() * t;
    if (!(Y.z() > 0.1)) return false;
    const double i = 1.0 / Y.z(), u = Y.x() * i, v = Y.y() * i;
    const double a = c.right.fx * i, b = c.right.fy * i;
    J_right << a * (R(0, 0) - u * R(2, 0)), a * (R(0, 1) - u * R(2, 1)),
        a * (t.x() - u * t.z()),  //
        b * (R(1, 0) - v * R(2, 0)), b * (R(1, 1) - v * R(2, 1)), b * (t.y() - v * t.z());
    information.noalias() = J_right.transpose() * J_right;
    information(0, 0) += c.left.fx * c.left.fx;
    information(1, 1) += c.left.fy * c.left.fy;
    covariance = information.inverse();
    // The left pixel is met exactly, so the right one alone is left over.
    q += covariance *
         (J_right.transpose() * Vec2(c.right.fx * (r.x() - u), c.right.fy * (r.y() - v)));
    return q.allFinite() && std::abs(q.z()) < kMaxInverseDepth;
  }
};

/// Derivative by θ of where least squares puts the point, −(JᵀJ)⁻¹ Jᵀ ∂pixels/∂θ: what depends on
/// the depth at q, the rest as triangulated.
bool point_by_theta(const Reference& c, const Triangulated& point, const Vec3& q,
                    const Transform& T_previous_now, Mat36* d) noexcept {
  const Vec3 turned = c.T_right_left.R * Vec3(q.x(), q.y(), 1);
  const Vec3 Y = turned + q.z() * c.T_right_left.t;
  if (!(Y.z() > 0.1)) return false;
  const double i = 1.0 / Y.z();
  Mat23 G;
  G << c.right.fx * i, 0, -c.right.fx * Y.x() * i * i, 0, c.right.fy * i,
      -c.right.fy * Y.y() * i * i;
  Mat26 J_theta;
  J_theta.leftCols<3>() = -G * skew(turned);
  J_theta.middleCols<2>(3) = G * (q.z() * c.length * c.B);
  J_theta.col(kLag) = -image_motion(c, q, T_previous_now);
  const Eigen::Matrix<double, 3, 2> back = point.covariance * point.J_right.transpose();
  d->noalias() = -(back * J_theta);
  return true;
}

template <class Range, class Value>
double median_of(Range& scratch, std::size_t n, const Value& value) noexcept {
  for (std::size_t i = 0; i < n; ++i) scratch[i] = value(i);
  return vergence::median(std::span(scratch).first(n));
}

}  // namespace

void MonitorResiduals::reset() noexcept {
  for (Memory& m : memories_) m.frame = 0;
}

StereoResiduals MonitorResiduals::stereo(const Reference& c, const MonitorFrame& frame,
                                         int min_matches, bool follow) noexcept {
  const double f = 0.5 * (c.right.fx + c.right.fy);
  const Transform T_previous_now = frame.T_now_previous.inverse();
  const Mat3& E = c.epipolar.E();
  rows_ = 0;
  for (const StereoObservation& s : frame.stereo) {
    if (rows_ == kMaxObservations) break;
    if (!(s.sigma_px > 0) || !s.left.allFinite() || !s.right.allFinite()) continue;
    StereoRow& row = stereo_[rows_];
    const Vec2 left = ray(c.left, s.left), right = ray(c.right, s.right);
    Vec5 J;
    if (!c.epipolar.to_line(left, right, &row.r, &J)) continue;
    row.r *= f;
    for (int i = 0; i < kFixed; ++i) row.J[static_cast<std::size_t>(i)] = f * J[i];
    const Vec2 normal = (E * left.homogeneous()).head<2>().normalized();
    const Vec2 v =
        image_motion(c, {left.x(), left.y(), inverse_depth(c, left, right)}, T_previous_now);
    row.J[kLag] = normal.dot(v);
    row.inverse_sigma2 =
        1.0 / (2.0 * s.sigma_px * s.sigma_px);  // two images' errors across the line
    row.track = s.track;
    if (std::isfinite(row.r) && std::isfinite(row.inverse_sigma2)) ++rows_;
  }
  StereoResiduals look;
  if (rows_ < static_cast<std::size_t>(min_matches)) return look;

  Vec5 fit = Vec5::Zero();
  for (int round = 0; round < kStereoRounds; ++round) {
    const auto rest = [&](const StereoRow& row) {
      return row.r + Eigen::Map<const Vec5>(row.J.data()).dot(fit);
    };
    const double middle = median_of(sizes_, rows_, [&](std::size_t i) {
      return std::abs(rest(stereo_[i])) * std::sqrt(stereo_[i].inverse_sigma2);
    });
    const double scale = std::max(middle / kMedianOfNormal, kMinScale);
    look.evidence = Evidence{};
    Evidence& e = look.evidence;
    for (std::size_t i = 0; i < rows_; ++i) {
      StereoRow& row = stereo_[i];
      const double d = rest(row);
      row.weight = row.inverse_sigma2 * tukey(d * d * row.inverse_sigma2, kTukey * scale);
      if (row.weight == 0) continue;
      std::size_t at = 0;
      for (std::size_t a = 0; a < kTheta; ++a) {
        const double wa = row.weight * row.J[a];
        e.g[a] -= wa * row.r;
        for (std::size_t b = 0; b <= a; ++b) e.A[at++] += wa * row.J[b];
      }
      e.n += row.weight;
    }
    std::array<double, kTriangle> A = e.A;
    for (int i = 0; i < kFixed; ++i) A[lower(i, i)] += 1.0 / (kFitSigma * kFitSigma);
    const Solved solved(A, e.g);
    for (int i = kFixed - 1; i >= 0; --i) {  // back through Lᵀ of the first five
      double s = solved.y[static_cast<std::size_t>(i)];
      for (int k = i + 1; k < kFixed; ++k) s -= solved.L[lower(k, i)] * fit[k];
      fit[i] = s / solved.L[lower(i, i)];
    }
  }
  look.usable = std::count_if(stereo_.begin(), stereo_.begin() + static_cast<std::ptrdiff_t>(rows_),
                              [](const StereoRow& r) { return r.weight > 0; }) >= min_matches;
  spread_of(look.evidence, fit, frame.frame, follow && look.usable, &look);
  return look;
}

void MonitorResiduals::spread_of(const Evidence& evidence, const Vec5& fit, std::uint64_t frame,
                                 bool follow, StereoResiduals* look) noexcept {
  // With x the part of a track in the gradient's noise and A = L Lᵀ: trace A⁻¹ Σ x xᵀ = Σ |L⁻¹ x|²,
  // and the variance that the frame adds to a running sum is Σ (x xᵀ + x sᵀ + s xᵀ), s what the
  // track brought before.
  const Solved factor(evidence.A, evidence.g);
  std::array<double, kFixed> inverse;
  for (int i = 0; i < kFixed; ++i)
    inverse[static_cast<std::size_t>(i)] = 1.0 / factor.L[lower(i, i)];
  const auto whitened = [&](std::array<double, kFixed>& v) {
    for (int i = 0; i < kFixed; ++i) {
      const auto ii = static_cast<std::size_t>(i);
      double s = v[ii];
      for (int k = 0; k < i; ++k) s -= factor.L[lower(i, k)] * v[static_cast<std::size_t>(k)];
      v[ii] = s * inverse[ii];
    }
  };
  double now = 0, before = 0;
  for (std::size_t i = 0; i < rows_; ++i) {
    const StereoRow& row = stereo_[i];
    const double size = row.weight * (row.r + Eigen::Map<const Vec5>(row.J.data()).dot(fit));
    std::array<double, kFixed> x, white;
    for (std::size_t a = 0; a < kFixed; ++a) white[a] = x[a] = size * row.J[a];
    whitened(white);
    for (const double a : white) now += a * a;
    if (!follow) continue;
    Memory& m = memories_[row.track % memories_.size()];
    if (m.frame == 0 || m.track != row.track || frame + 1 - m.frame > kTrackGap)
      m = Memory{row.track, 0, {}};
    std::array<double, kFixed> s = m.sum;
    whitened(s);
    for (std::size_t a = 0; a < kFixed; ++a) before += 2 * white[a] * s[a], m.sum[a] += x[a];
    m.frame = frame + 1;
  }
  look->spread_now = kTukeySpread * now / kFixed;
  look->spread_life = kTukeySpread * (now + before) / kFixed;
}

bool MonitorResiduals::motion_row(const Reference& c, const MonitorFrame& frame,
                                  const MotionTrack& track, MotionRow* row) noexcept {
  const Transform& T = frame.T_now_before;
  if (!(track.sigma_px > 0)) return false;
  const Transform T_previous_now = frame.T_now_previous.inverse(),
                  T_earlier_before = frame.T_before_earlier.inverse();
  Triangulated b, n;
  if (!b.from(c, track.left_before, track.right_before) ||
      !n.from(c, track.left_now, track.right_now))
    return false;

  // h: q before → q now, by Y = R (x, y, 1) + t/Z.
  Mat3 D;
  const auto carried = [&](const Vec3& q, Vec3* to, Vec3* at) {
    const Vec3 Y = T.R * Vec3(q.x(), q.y(), 1) + q.z() * T.t;
    if (!(Y.z() > 0.05)) return false;
    const double i = 1.0 / Y.z();
    *to = {Y.x() * i, Y.y() * i, q.z() * i};
    *at = Y;
    return true;
  };
  Vec3 now, Y;
  if (!carried(b.q, &now, &Y)) return false;
  const auto derivative = [&](const Vec3& q, const Vec3& at) {
    const double i = 1.0 / at.z();
    Mat3 M;  // ∂h/∂Y
    M << i, 0, -at.x() * i * i, 0, i, -at.y() * i * i, 0, 0, -q.z() * i * i;
    return M;
  };
  Mat3 M = derivative(b.q, Y);
  Mat3 columns;
  columns << T.R.col(0), T.R.col(1), T.t;
  D.noalias() = M * columns;
  D(2, 2) += 1.0 / Y.z();
  const Vec3 gap = n.q - now;
  if (!gap.allFinite()) return false;

  // Linearised at the point both observations agree on: its error and the gap's are independent, so
  // noise in depth does not bias the fit.
  const Mat3 joint = b.information + D.transpose() * n.information * D;
  const Vec3 q = b.q + joint.inverse() * (D.transpose() * (n.information * gap));
  if (!carried(q, &now, &Y)) return false;
  M = derivative(q, Y);
  D.noalias() = M * columns;
  D(2, 2) += 1.0 / Y.z();
  Mat36 by_theta_now, by_theta_before, J_theta, J_pose;
  if (!point_by_theta(c, n, now, T_previous_now, &by_theta_now)) return false;
  if (!point_by_theta(c, b, q, T_earlier_before, &by_theta_before)) return false;
  J_theta = by_theta_now - D * by_theta_before;
  J_pose.leftCols<3>() = M * skew(Y - q.z() * T.t);
  J_pose.rightCols<3>() = -q.z() * M;

  const Mat3 C = n.covariance + D * b.covariance * D.transpose();  // of the gap, for 1 px
  const Cholesky<3> factor(C);
  if (!factor.ok()) return false;
  const Mat3 whiten = factor.whitening();
  row->r.noalias() = whiten * gap;
  row->J_theta.noalias() = whiten * J_theta;
  row->J_pose.noalias() = whiten * J_pose;
  row->inverse_sigma2 = 1.0 / (track.sigma_px * track.sigma_px);
  return row->r.allFinite() && row->J_theta.allFinite() && row->J_pose.allFinite();
}

MotionResiduals MonitorResiduals::motion(const Reference& c, const MonitorFrame& frame) noexcept {
  std::size_t n = 0;
  for (const MotionTrack& track : frame.motion) {
    if (n == motion_.size()) break;
    if (motion_row(c, frame, track, &motion_[n])) ++n;
  }
  MotionResiduals look;
  if (n < kMinMotionTracks) return look;

  Vec6 pose = Vec6::Zero(), theta = Vec6::Zero(), g_theta, g_pose;
  Mat6 A_theta, A_pose, A_cross;  // A_cross: θ by pose
  Cholesky<6> pose_factor(Mat6::Identity());
  for (int round = 0; round < kMotionRounds; ++round) {
    const auto size2 = [&](const MotionRow& row) {
      return (row.r + row.J_theta * theta + row.J_pose * pose).squaredNorm() * row.inverse_sigma2;
    };
    for (std::size_t i = 0; i < n; ++i) motion_[i].weight = size2(motion_[i]);
    const double middle = median_of(sizes_, n, [&](std::size_t i) { return motion_[i].weight; });
    const double scale = std::max(std::sqrt(middle) / kMedian3, kMinScale);
    A_theta.setZero(), A_pose.setZero(), A_cross.setZero(), g_theta.setZero(), g_pose.setZero();
    for (std::size_t i = 0; i < n; ++i) {
      MotionRow& row = motion_[i];
      row.weight = row.inverse_sigma2 * tukey(row.weight, kTukey3 * scale);
      if (row.weight == 0) continue;
      const Mat36 weighted_theta = row.weight * row.J_theta,
                  weighted_pose = row.weight * row.J_pose;
      A_theta.noalias() += weighted_theta.transpose() * row.J_theta;
      A_cross.noalias() += weighted_theta.transpose() * row.J_pose;
      A_pose.noalias() += weighted_pose.transpose() * row.J_pose;
      g_theta.noalias() -= weighted_theta.transpose() * row.r;
      g_pose.noalias() -= weighted_pose.transpose() * row.r;
    }
    for (int i = 0; i < 6; ++i) A_pose(i, i) *= 1.0 + 1e-9;
    pose_factor = Cholesky<6>(A_pose);
    if (!pose_factor.ok()) return look;
    const Mat6 eliminated = pose_factor.solve(Mat6(A_cross.transpose()));
    Mat6 A = A_theta - A_cross * eliminated;
    const Vec6 g = g_theta - eliminated.transpose() * g_pose;
    look.evidence = Evidence{};
    for (int i = 0; i < kTheta; ++i)
      for (int j = 0; j <= i; ++j) look.evidence.A[lower(i, j)] = 0.5 * (A(i, j) + A(j, i));
    Eigen::Map<Vec6>(look.evidence.g.data()) = g;
    // The fit of this look alone: the lag and the directions it hardly sees are left where they
    // are.
    Mat6 regular = A;
    regular.diagonal().head<kFixed>().array() += 1.0 / (kFitSigma * kFitSigma);
    regular(kLag, kLag) += 1e12;
    theta = ldlt_solve(regular, g);
    pose = pose_factor.solve(Vec6(g_pose - A_cross.transpose() * theta));
  }
  const Solved factor(look.evidence.A, look.evidence.g);
  const Mat6 eliminated = pose_factor.solve(Mat6(A_cross.transpose()));
  double spread = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const MotionRow& row = motion_[i];
    if (row.weight == 0) continue;
    const Vec3 rest = row.weight * (row.r + row.J_theta * theta + row.J_pose * pose);
    const Vec6 x =
        row.J_theta.transpose() * rest - eliminated.transpose() * (row.J_pose.transpose() * rest);
    std::array<double, kFixed> y{};
    for (int a = 0; a < kFixed; ++a) {
      double s = x[a];
      for (int k = 0; k < a; ++k) s -= factor.L[lower(a, k)] * y[static_cast<std::size_t>(k)];
      y[static_cast<std::size_t>(a)] = s / factor.L[lower(a, a)];
      spread += y[static_cast<std::size_t>(a)] * y[static_cast<std::size_t>(a)];
    }
    look.evidence.n +=
        1.5 * row.weight;  // three numbers a track, each the difference of two observations
  }
  // The look's own fit has taken up eleven of its 3 n numbers.
  const double numbers = 3.0 * static_cast<double>(n);
  look.spread = kTukeySpread3 * numbers / (numbers - kTheta - kFixed) * spread / kFixed;
  look.usable = true;
  return look;
}

}  // namespace vergence::calibration::detail
