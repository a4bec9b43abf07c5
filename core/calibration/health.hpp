#pragma once
#include <array>
#include <string_view>

#include "core/calibration/options.hpp"
#include "core/types/calibration.hpp"

namespace vergence::calibration {

enum class CalibrationRating : std::uint8_t { good, can_be_improved, recalibrate };
/// `good`, `can be improved`, `recalibrate`.
[[nodiscard]] std::string_view to_string(CalibrationRating) noexcept;

inline constexpr std::array kHealthDepths = {1.0, 5.0, 10.0, 20.0, 50.0};  // m

/// What a calibration's uncertainty does to a depth measured with camera 0 and camera `k`, 1 sigma,
/// percent of the depth.
///
/// The root mean over a grid of directions that both cameras see of the relative depth's gradient
/// propagated through `covariance`, lenses included; without one, that of the transform through
/// covariance_total; without that, through the sigmas; without those 0. Matching noise is not in
/// it: this is what stays however well a point is found. Threads pure.
[[nodiscard]] double depth_error_percent(const RigCalibration& rig, int k, double depth_m) noexcept;

/// How far apart the depths are that two calibrations give to the same pairs of pixels, at a depth
/// by `measured`: root mean over the image, percent (of the inverse depth). Threads pure.
[[nodiscard]] double depth_error_percent(const RigCalibration& measured,
                                         const RigCalibration& claimed, int k,
                                         double depth_m) noexcept;

/// Where a calibration has to be good to `max_depth_error_percent`: at reference_depth_m, or
/// nearer, where the noise of one match, of that pixel sigma, is half of it: there short baselines
/// can reach it. m.
[[nodiscard]] double reference_depth_m(const RigCalibration& rig, int k,
                                       const CalibrationOptions& options,
                                       double pixel_sigma) noexcept;

/// The same for the whole rig: its best pair, as a depth is measured with.
[[nodiscard]] double depth_error_percent(const RigCalibration& rig, double depth_m) noexcept;

/// The word for a rig, by its depth error at 20 m.
[[nodiscard]] CalibrationRating health(const RigCalibration& rig,
                                       const CalibrationOptions& options) noexcept;

}  // namespace vergence::calibration
