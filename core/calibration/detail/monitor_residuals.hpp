#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/calibration/monitor.hpp"
#include "core/calibration/posterior.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/math/linear_solve.hpp"
#include "core/memory/fixed_vector.hpp"

namespace vergence::calibration::detail {

/// Size of the monitor's θ: rotation φ (3, rad) and the direction of t by α and β (rad).
inline constexpr int kTheta = 5;
/// Rate of a fast running mean of widths, per frame: over ten frames, a second of the slowest rigs.
inline constexpr double kFastUpdate = 0.1;

/// Gradient g, information A and weight n (1/px²) of θ from observations with residuals r at θ = 0,
/// derivatives J and weights w: g = −Σ w Jᵀ r / σ², A = Σ w Jᵀ J / σ², n = Σ w / σ². All numbers
/// add up over frames.
struct Evidence {
  Vec5 g = Vec5::Zero();
  Mat5 A = Mat5::Zero();
  double n = 0;

  void add(const Evidence& e, double scale = 1.0) noexcept {
    g += scale * e.g;
    A += scale * e.A;
    n += scale * e.n;
  }
  [[nodiscard]] Evidence scaled(double scale) const noexcept {
    Evidence e;
    e.add(*this, scale);
    return e;
  }
};

/// Factorises A with the prior of an unknown transform, which keeps unobserved directions at zero.
[[nodiscard]] inline Cholesky<5> with_prior(const Mat5& A) noexcept {
  return Cholesky<5>(A + Mat5::Identity() / (kUnknownTransform * kUnknownTransform));
}

/// Displacement of matches by θ = A⁻¹ g, px rms over the image.
[[nodiscard]] inline double shift_px(const Evidence& e) noexcept {
  const Vec5 theta = with_prior(e.A).solve(e.g);
  return e.n > 0 ? std::sqrt(std::max(0.0, theta.dot(e.A * theta)) / e.n) : 0;
}

/// gᵀ A⁻¹ g.
[[nodiscard]] inline double gain(const Mat5& A, const Vec5& g) noexcept {
  return g.dot(with_prior(A).solve(g));
}

/// Maximum number of observations of a frame; further ones are left out.
inline constexpr std::size_t kMaxObservations = 1024;

/// Evidence from one frame's stereo matches.
struct StereoResiduals {
  std::uint64_t frame = 0;
  /// True if there are enough matches.
  bool usable = false;
  Evidence evidence;
  /// Ratio of the variance of g in this frame to that of white noise: mean over the five
  /// parameters.
  double spread_now = 0;
  /// This ratio with the correlation to earlier observations of the same tracks. Its sum over
  /// frames gives the variance of the summed gradient.
  double spread_life = 0;
};

/// Turns observations into evidence about θ, with redescending weights around the frame's own
/// robust fit, so that the matches of a shifted rig are not outliers.
///
/// Memory  Fixed, in place (about 250 kB): lives in an arena. Time: linear in the observations.
class MonitorResiduals {
 public:
  void reset() noexcept;
  /// Each track's gradient is accumulated for spread_life, but not at standstill, where tracks do
  /// not end.
  [[nodiscard]] StereoResiduals stereo(const StereoPair& pair, const MonitorFrame& frame,
                                       int min_matches) noexcept;

 private:
  struct StereoRow {
    Vec5 J;
    // Residual, in px.
    double r;
    // Inverse variance of r, in 1/px².
    double inverse_sigma2;
    double weight;
    std::uint32_t track;
  };
  struct Memory {
    bool used = false;
    std::uint32_t track = 0;
    Vec5 sum = Vec5::Zero();
  };
  void measure_spread(const Evidence& evidence, const Vec5& fit, bool follow,
                      StereoResiduals* result) noexcept;

  FixedVector<StereoRow, kMaxObservations> rows_;
  std::array<double, kMaxObservations> sizes_{};
  // Memory by track number; a newer track replaces one with the same low bits.
  std::array<Memory, 4096> memories_{};
};

}  // namespace vergence::calibration::detail
