#pragma once
#include <array>
#include <cstdint>

#include "core/calibration/detail/monitor_evidence.hpp"
#include "core/calibration/monitor.hpp"

namespace vergence::calibration::detail {

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

  std::size_t rows_ = 0;
  std::array<StereoRow, kMaxObservations> stereo_{};
  std::array<double, kMaxObservations> sizes_{};
  // Memory by track number; a newer track replaces one with the same low bits.
  std::array<Memory, 4096> memories_{};
};

}  // namespace vergence::calibration::detail
