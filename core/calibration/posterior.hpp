#pragma once
#include "core/calibration/options.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Sigma of an unknown transform, rotation in rad and translation in baselines: wider than the
/// error of any rig whose images still match.
inline constexpr double kUnknownTransform = 0.2;
/// Sigma of the transforms of a calibration without sigmas, in the same units: twice the yaw of 26
/// mrad that the principal points of a recorded calibration contain.
inline constexpr double kSuppliedTransform = 0.05;
/// Usual RigCalibration::inflation of a solve of 15 to 25 frames: 5 to 37 on recorded sequences
/// (build/bench/calibration_bench solves).
inline constexpr double kUsualInflation = 20;

/// Widens the joint covariance of a calibration by the random walk of `hours`. Pure.
void let_drift(double hours, const CalibrationOptions& options, RigCalibration* rig) noexcept;

/// Sets the uncertainty of the transforms to `sigma`, rotation in rad and translation in baselines,
/// and keeps that of the intrinsics. Pure.
void assume_transforms(double sigma, RigCalibration* rig) noexcept;

/// Squared difference of two calibrations' transforms of camera k ≥ 1 over its variance, mean over
/// the five parameters that images determine; 1 on average for calibrations found from disjoint
/// segments of one sequence if their sigmas are correct. No ground truth is needed.
///
/// Both need a joint covariance. Sigmas are of noise alone, because both calibrations share the
/// errors of fixed intrinsics. Pure.
[[nodiscard]] double agreement(const RigCalibration& a, const RigCalibration& b, int k) noexcept;

/// Joint covariance conditional on camera 0's focal lengths and principal point, which solves keep
/// fixed. Pure.
[[nodiscard]] RigCovariance noise_only(const RigCovariance& wide) noexcept;

}  // namespace vergence::calibration
