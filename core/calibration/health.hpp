#pragma once
#include <array>
#include <string_view>

#include "core/calibration/options.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

/// Depths at which errors are reported, in metres, and the one of the rating.
inline constexpr std::array kHealthDepths = {1.0, 5.0, 10.0, 20.0, 50.0};
inline constexpr double kRatingDepth = kHealthDepths[3];

/// Sigma of a depth measured with camera 0 and camera `k` that the calibration's uncertainty
/// causes, percent of the depth.
///
/// Root mean square over a grid of directions that both cameras see. The relative depth's gradient
/// is propagated through the first of these that the rig has: `covariance` (intrinsics included),
/// covariance_total of the transform, or its sigmas; 0 without any. Matching noise is not included.
/// Pure.
[[nodiscard]] double depth_error_percent(const RigCalibration& rig, int k, double depth_m) noexcept;

/// Difference of the depths that two calibrations assign to the same pairs of pixels, for points
/// that `measured` puts at depth_m: root mean square over the image, in percent of the inverse
/// depth. Pure.
[[nodiscard]] double depth_error_percent(const RigCalibration& measured,
                                         const RigCalibration& current, int k,
                                         double depth_m) noexcept;

/// Depth in metres at which a calibration must be within `max_depth_error_percent`:
/// options.reference_depth_m, or for short baselines the depth at which the noise of one match is
/// half of that.
[[nodiscard]] double reference_depth_m(const RigCalibration& rig, int k,
                                       const CalibrationOptions& options,
                                       double pixel_sigma) noexcept;

/// Sigma of a depth measured with the rig's best pair of cameras, percent of the depth.
[[nodiscard]] double depth_error_percent(const RigCalibration& rig, double depth_m) noexcept;

/// Rating of a rig by its depth error at kRatingDepth: `good`, `fair` or `poor`.
[[nodiscard]] std::string_view rating(const RigCalibration& rig,
                                      const CalibrationOptions& options) noexcept;

}  // namespace vergence::calibration
