#include "core/calibration/detail/monitor_residuals.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/linear_solve.hpp"
#include "core/math/robust.hpp"

namespace vergence::calibration::detail {
namespace {

// Correction because an M-estimate's covariance has E ψ' where this code sums E w: (E w / E ψ')²
// for Gaussian errors at kTukey.
constexpr double kTukeySpread = 1.46;

}  // namespace

void MonitorResiduals::reset() noexcept {
  for (Memory& m : memories_) m.used = false;
}

StereoResiduals MonitorResiduals::stereo(const StereoPair& pair, const MonitorFrame& frame,
                                         int min_matches) noexcept {
  const EpipolarGeometry epipolar(pair.T_camera_left);
  const double f = 0.5 * (pair.camera.fx + pair.camera.fy);
  rows_.clear();
  for (const StereoObservation& s : frame.stereo) {
    if (!(s.sigma_px > 0) || !s.left.allFinite() || !s.right.allFinite()) continue;
    StereoRow row{};
    if (!epipolar.to_line(ray(pair.left, s.left), ray(pair.camera, s.right), &row.r, &row.J))
      continue;
    row.r *= f;
    row.J *= f;
    // The errors of both images add up across the line.
    row.inverse_sigma2 = 1.0 / (2.0 * s.sigma_px * s.sigma_px);
    row.track = s.track;
    if (std::isfinite(row.r) && std::isfinite(row.inverse_sigma2)) (void)rows_.push(row);
  }
  StereoResiduals result;
  result.frame = frame.frame;
  if (rows_.size() < static_cast<std::size_t>(min_matches)) return result;

  Vec5 fit = Vec5::Zero();
  for (int round = 0; round < kReweightings; ++round) {
    const auto rest = [&](const StereoRow& row) { return row.r + row.J.dot(fit); };
    for (std::size_t i = 0; i < rows_.size(); ++i)
      sizes_[i] = std::abs(rest(rows_[i])) * std::sqrt(rows_[i].inverse_sigma2);
    const double scale =
        std::max(median(std::span(sizes_).first(rows_.size())) / kMedianOfNormal, kMinScale);
    result.evidence = Evidence{};
    Evidence& e = result.evidence;
    for (StereoRow& row : rows_) {
      const double d = rest(row);
      row.weight = row.inverse_sigma2 * tukey(d * d * row.inverse_sigma2, kTukey * scale);
      if (row.weight == 0) continue;
      e.g -= row.weight * row.r * row.J;
      e.A.noalias() += row.weight * row.J * row.J.transpose();
      e.n += row.weight;
    }
    fit = with_prior(e.A).solve(e.g);
  }
  result.usable =
      std::ranges::count_if(rows_, [](const StereoRow& r) { return r.weight > 0; }) >= min_matches;
  measure_spread(result.evidence, fit, frame.moving && result.usable, &result);
  return result;
}

void MonitorResiduals::measure_spread(const Evidence& evidence, const Vec5& fit, bool follow,
                                      StereoResiduals* result) noexcept {
  // With x a track's contribution to the gradient's noise and A = L Lᵀ: trace A⁻¹ Σ x xᵀ = Σ |L⁻¹
  // x|². The variance that the frame adds to a running sum is Σ (x xᵀ + x sᵀ + s xᵀ), with s the
  // sum of the track's earlier contributions.
  const Mat5 whiten = with_prior(evidence.A).whitening();
  double now = 0, before = 0;
  for (const StereoRow& row : rows_) {
    const Vec5 x = row.weight * (row.r + row.J.dot(fit)) * row.J;
    const Vec5 white = whiten * x;
    now += white.squaredNorm();
    if (!follow) continue;
    Memory& m = memories_[row.track % memories_.size()];
    if (!m.used || m.track != row.track) m = Memory{true, row.track, Vec5::Zero()};
    before += 2 * white.dot(whiten * m.sum);
    m.sum += x;
  }
  result->spread_now = kTukeySpread * now / kTheta;
  result->spread_life = kTukeySpread * (now + before) / kTheta;
}

}  // namespace vergence::calibration::detail
