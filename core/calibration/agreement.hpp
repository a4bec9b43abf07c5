#pragma once
#include <array>

#include "core/calibration/health.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Normalised squared differences of two calibrations found from disjoint segments of one
/// drive: 1 on average where their sigmas are true; no ground truth is needed.
struct Agreement {
  static constexpr std::size_t kDepths = 4;
  static constexpr std::array<double, kDepths> kDepthM = {5, 10, 20, 50};
  std::array<double, kDepths>
      depth{};  // mean over the image of (difference / sigma)², of the inverse depth
  std::array<double, kDepths> depth_percent{};  // root mean square difference, percent
  double transform = 0;   // of the five parameters of the transform together, over five
  double intrinsics = 0;  // mean of fx fy cx cy of camera k, each by itself
};

/// Compares camera k ≥ 1 of two calibrations, both with their joint covariance. Sigmas are those of
/// noise alone, because errors of held intrinsics are the same in both. Pure.
[[nodiscard]] Agreement agreement(const RigCalibration& a, const RigCalibration& b, int k) noexcept;

/// The joint covariance given that camera 0's focal lengths and centre, which solves hold, are as
/// they are. Threads pure.
[[nodiscard]] RigCovariance noise_only(const RigCovariance& wide) noexcept;

}  // namespace vergence::calibration
