#include "core/calibration/detail/monitor_residuals.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"
#include "core/math/robust.hpp"

namespace vergence::calibration::detail {
namespace {

constexpr int kStereoRounds =
    3;  // of reweighting: the scale falls from that of a knock to that of the noise in two
constexpr double kMinScale = 0.1;  // of the sigma the observations claim
// An M-estimate's covariance has E ψ' where this code sums E w: (E w / E ψ')² for Gaussian errors
// at kTukey.
constexpr double kTukeySpread = 1.46;
constexpr double kFitSigma =
    0.1;  // rad: prior that keeps a frame's own fit from running off where it sees nothing
constexpr std::uint64_t kTrackGap = 30;  // frames: a number seen after longer is another track

Vec2 ray(const Pinhole& k, const Vec2& pixel) noexcept {
  return {(pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy};
}

double tukey(double squared, double limit) noexcept {
  const double u = 1.0 - squared / (limit * limit);
  return u > 0 ? u * u : 0.0;
}

}  // namespace

void MonitorResiduals::reset() noexcept {
  for (Memory& m : memories_) m.frame = 0;
}

StereoResiduals MonitorResiduals::stereo(const Reference& c, const MonitorFrame& frame,
                                         int min_matches, bool follow) noexcept {
  const double f = 0.5 * (c.right.fx + c.right.fy);
  rows_ = 0;
  for (const StereoObservation& s : frame.stereo) {
    if (rows_ == kMaxObservations) break;
    if (!(s.sigma_px > 0) || !s.left.allFinite() || !s.right.allFinite()) continue;
    StereoRow& row = stereo_[rows_];
    const Vec2 left = ray(c.left, s.left), right = ray(c.right, s.right);
    Vec5 J;
    if (c.epipolar.to_line(left, right, &row.r, &J) != EpipolarStatus::ok) continue;
    row.r *= f;
    for (int i = 0; i < kTheta; ++i) row.J[static_cast<std::size_t>(i)] = f * J[i];
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
    for (std::size_t i = 0; i < rows_; ++i)
      sizes_[i] = std::abs(rest(stereo_[i])) * std::sqrt(stereo_[i].inverse_sigma2);
    const double scale =
        std::max(median(std::span(sizes_).first(rows_)) / kMedianOfNormal, kMinScale);
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
    for (int i = 0; i < kTheta; ++i) A[lower(i, i)] += 1.0 / (kFitSigma * kFitSigma);
    const Solved solved(A, e.g);
    for (int i = kTheta - 1; i >= 0; --i) {  // back through Lᵀ
      double s = solved.y[static_cast<std::size_t>(i)];
      for (int k = i + 1; k < kTheta; ++k) s -= solved.L[lower(k, i)] * fit[k];
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
  std::array<double, kTheta> inverse;
  for (int i = 0; i < kTheta; ++i)
    inverse[static_cast<std::size_t>(i)] = 1.0 / factor.L[lower(i, i)];
  const auto whitened = [&](std::array<double, kTheta>& v) {
    for (int i = 0; i < kTheta; ++i) {
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
    std::array<double, kTheta> x, white;
    for (std::size_t a = 0; a < kTheta; ++a) white[a] = x[a] = size * row.J[a];
    whitened(white);
    for (const double a : white) now += a * a;
    if (!follow) continue;
    Memory& m = memories_[row.track % memories_.size()];
    if (m.frame == 0 || m.track != row.track || frame + 1 - m.frame > kTrackGap)
      m = Memory{row.track, 0, {}};
    std::array<double, kTheta> s = m.sum;
    whitened(s);
    for (std::size_t a = 0; a < kTheta; ++a) before += 2 * white[a] * s[a], m.sum[a] += x[a];
    m.frame = frame + 1;
  }
  look->spread_now = kTukeySpread * now / kTheta;
  look->spread_life = kTukeySpread * (now + before) / kTheta;
}

}  // namespace vergence::calibration::detail
