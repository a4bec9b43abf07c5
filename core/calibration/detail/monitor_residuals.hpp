#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/calibration/detail/monitor_evidence.hpp"
#include "core/calibration/monitor.hpp"
#include "core/geometry/epipolar.hpp"

namespace vergence::calibration::detail {

inline constexpr std::size_t kMaxObservations = 1024;  // of a frame; further ones are left out

/// The reference calibration with derived quantities.
struct Reference {
  EpipolarGeometry epipolar{Transform{}};
  Pinhole left{}, right{};
};

/// Evidence from one frame's stereo matches.
struct StereoResiduals {
  bool usable = false;  // enough matches
  Evidence evidence;
  double spread_now = 0;   // variance of g, this frame alone, over the white one: mean of the five
  double spread_life = 0;  // and with what the same tracks said before: its sum over frames is the
                           // variance of the sum
};

/// Turns observations into evidence about θ, with redescending weights about the frame's own robust
/// fit: a shifted rig is no outlier.
///
/// Memory  Fixed, in place (some 250 kB): lives in an arena. Time: linear in the observations.
class MonitorResiduals {
 public:
  void reset() noexcept;
  /// `follow`: remember what each track said, for spread_life. Off while the camera stands, where
  /// tracks do not end.
  [[nodiscard]] StereoResiduals stereo(const Reference& reference, const MonitorFrame& frame,
                                       int min_matches, bool follow) noexcept;

 private:
  struct StereoRow {
    Vec5 J;                 // px
    double r;               // px
    double inverse_sigma2;  // of r, 1/px²
    double weight;
    std::uint32_t track;
  };
  struct Memory {
    std::uint32_t track = 0;
    std::uint64_t frame = 0;  // of the last observation, plus one; 0: empty
    Vec5 sum = Vec5::Zero();
  };
  void spread_of(const Evidence& evidence, const Vec5& fit, std::uint64_t frame, bool follow,
                 StereoResiduals* look) noexcept;

  std::size_t rows_ = 0;
  std::array<StereoRow, kMaxObservations> stereo_{};
  std::array<double, kMaxObservations> sizes_{};  // scratch of the median
  std::array<Memory, 4096> memories_{};  // by track number; a newer track takes the place of one
                                         // that has the same last bits
};

}  // namespace vergence::calibration::detail
