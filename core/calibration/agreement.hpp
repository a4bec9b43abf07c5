#pragma once
#include <array>

#include "core/calibration/health.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Normalised squared differences of two calibrations found from disjoint segments of one sequence;
/// 1 on average if their sigmas are correct. No ground truth is needed.
struct Agreement {
  static constexpr std::size_t kDepths = 4;
  static constexpr std::array<double, kDepths> kDepthM = {5, 10, 20, 50};
  /// Mean over the image of the squared difference of inverse depths over its variance.
  std::array<double, kDepths> depth{};
  /// Root mean square difference of inverse depths.
  std::array<double, kDepths> depth_percent{};
  /// Normalised squared difference of the transform's five parameters, over five.
  double transform = 0;
  /// Mean over fx, fy, cx and cy of camera k, without their correlations.
  double intrinsics = 0;
};

/// Compares camera k ≥ 1 of two calibrations, both with their joint covariance. Sigmas are of noise
/// alone, because both calibrations share the errors of fixed intrinsics. Pure.
[[nodiscard]] Agreement agreement(const RigCalibration& a, const RigCalibration& b, int k) noexcept;

/// Joint covariance conditional on camera 0's focal lengths and principal point, which solves keep
/// fixed. Pure.
[[nodiscard]] RigCovariance noise_only(const RigCovariance& wide) noexcept;

}  // namespace vergence::calibration
