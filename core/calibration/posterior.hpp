#pragma once
#include "core/calibration/options.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Sigma of an unknown transform, rotation in rad and translation in baselines: wider than the
/// error of any rig whose images still match.
inline constexpr double kUnknownTransform = 0.2;

/// Widens the joint covariance of a calibration by the random walk of `hours`. Pure.
void let_drift(double hours, const CalibrationOptions& options, RigCalibration* rig) noexcept;

/// Marks the transforms as unknown and keeps the intrinsics, because cameras may have been moved.
/// Pure.
void clear_transforms(RigCalibration* rig) noexcept;

}  // namespace vergence::calibration
