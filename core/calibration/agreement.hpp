#pragma once
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Squared difference of two calibrations' transforms of camera k ≥ 1 over its variance, mean over
/// the five parameters that images determine; 1 on average for calibrations found from disjoint
/// segments of one sequence if their sigmas are correct. No ground truth is needed.
///
/// Both have their joint covariance. Sigmas are of noise alone, because both calibrations share the
/// errors of fixed intrinsics. Pure.
[[nodiscard]] double agreement(const RigCalibration& a, const RigCalibration& b, int k) noexcept;

/// Joint covariance conditional on camera 0's focal lengths and principal point, which solves keep
/// fixed. Pure.
[[nodiscard]] RigCovariance noise_only(const RigCovariance& wide) noexcept;

}  // namespace vergence::calibration
