#include "core/calibration/health.hpp"

#include <algorithm>
#include <cmath>

#include "core/calibration/detail/depth.hpp"

namespace vergence::calibration {

std::string_view to_string(CalibrationRating rating) noexcept {
  static constexpr std::array<std::string_view, 3> names = {"good", "fair", "poor"};
  return names[static_cast<std::size_t>(rating)];
}

double depth_error_percent(const RigCalibration& rig, int k, double depth_m) noexcept {
  const Transform& T = rig.T_camera_left[static_cast<std::size_t>(k)];
  const bool joint = !rig.covariance.empty();
  double sum = 0;
  int seen = 0;
  detail::for_places(rig, k, depth_m, [&](const detail::CovisiblePoint& p) noexcept {
    sum += detail::depth_variance(rig, k, detail::depth_gradient(p, T, k, joint), joint);
    ++seen;
  });
  return seen == 0 ? 0.0 : 100.0 * std::sqrt(std::max(0.0, sum / seen));
}

double depth_error_percent(const RigCalibration& measured, const RigCalibration& current, int k,
                           double depth_m) noexcept {
  const detail::DepthReader reader(current, k);
  double sum = 0;
  int seen = 0;
  detail::for_places(measured, k, depth_m, [&](const detail::CovisiblePoint& p) noexcept {
    double relative = 0;
    if (!reader.difference(p, &relative)) return;
    sum += relative * relative;
    ++seen;
  });
  return seen == 0 ? 0.0 : 100.0 * std::sqrt(sum / seen);
}

double reference_depth_m(const RigCalibration& rig, int k, const CalibrationOptions& options,
                         double pixel_sigma) noexcept {
  const auto c = static_cast<std::size_t>(k);
  // Share of the tolerance for the noise of a single match.
  constexpr double kOfTolerance = 0.5;
  const double tolerated_px =
      std::sqrt(2.0) * pixel_sigma / (kOfTolerance * 0.01 * options.max_depth_error_percent);
  return std::min(options.reference_depth_m,
                  rig.intrinsics[0].fx * rig.T_camera_left[c].t.norm() / tolerated_px);
}

double depth_error_percent(const RigCalibration& rig, double depth_m) noexcept {
  double best = 0;
  for (int k = 1; k < rig.cameras; ++k) {
    const double error = depth_error_percent(rig, k, depth_m);
    // The error is zero if no direction is seen by both cameras, or the pair has no covariance.
    if (error > 0 && (best == 0 || error < best)) best = error;
  }
  return best;
}

CalibrationRating health(const RigCalibration& rig, const CalibrationOptions& options) noexcept {
  const double error = depth_error_percent(rig, kRatingDepth);
  if (error <= options.good_depth_percent) return CalibrationRating::good;
  return error <= options.usable_depth_percent ? CalibrationRating::can_be_improved
                                               : CalibrationRating::recalibrate;
}

}  // namespace vergence::calibration
