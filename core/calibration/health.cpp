#include "core/calibration/health.hpp"

#include <algorithm>
#include <cmath>

#include "core/camera/camera.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {
namespace {

constexpr int kGrid = 7;           // directions a side
constexpr double kWordDepth = 20;  // m

Mat6 covariance_of(const RigCalibration& rig, std::size_t k) noexcept {
  if (rig.covariance_wide[k].squaredNorm() > 0) return rig.covariance_wide[k];
  Mat6 C = Mat6::Zero();
  for (int i = 0; i < 6; ++i) C(i, i) = rig.sigma_wide[k][static_cast<std::size_t>(i)] * rig.sigma_wide[k][static_cast<std::size_t>(i)];
  return C;
}

}  // namespace

std::string_view to_string(HealthWord word) noexcept {
  static constexpr std::array<std::string_view, 3> names = {"good", "can be improved", "recalibrate"};
  return names[static_cast<std::size_t>(word)];
}

double depth_error_percent(const RigCalibration& rig, int k, double depth_m) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const Mat6 C = covariance_of(rig, c);
  const Transform& T = rig.T_camera_left[c];
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[c]);
  double sum = 0;
  int seen = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      Vec3 ray;
      const Vec2 pixel((column + 0.5) / kGrid * rig.intrinsics[0].width, (row + 0.5) / kGrid * rig.intrinsics[0].height);
      if (!left.unproject(pixel, &ray)) continue;
      const Vec3 turned = T.R * (ray * depth_m), X = turned + T.t;
      Vec2 at;
      Mat23 G;
      if (right.project(X, &at, &G) != ProjectStatus::ok || !right.inside(at, 0.0)) continue;
      // The right pixel moves by G (ray-direction) per metre of depth and by G (−[R X]×, I) per calibration error: the depth that
      // a match then gives is the one that takes up the part along the epipolar line.
      const Vec2 by_depth = G * (T.R * ray);
      const double squared = by_depth.squaredNorm();
      if (!(squared > 0)) continue;
      Eigen::Matrix<double, 2, 6> by_rig;
      by_rig << -G * skew(turned), G;
      const Eigen::Matrix<double, 1, 6> J = -by_depth.transpose() * by_rig / squared;
      sum += (J * C * J.transpose())(0, 0);
      ++seen;
    }
  }
  return seen == 0 ? 0.0 : 100.0 * std::sqrt(std::max(0.0, sum / seen)) / depth_m;
}

double depth_error_percent(const RigCalibration& rig, double depth_m) noexcept {
  double best = 0;
  for (int k = 1; k < rig.cameras; ++k) {
    const double error = depth_error_percent(rig, k, depth_m);
    // Zero says that no direction is seen by both, or that nothing is known of the pair.
    if (error > 0 && (best == 0 || error < best)) best = error;
  }
  return best;
}

HealthWord health(const RigCalibration& rig, const CalibrationOptions& options) noexcept {
  const double error = depth_error_percent(rig, kWordDepth);
  if (error <= options.good_depth_percent) return HealthWord::good;
  return error <= options.usable_depth_percent ? HealthWord::can_be_improved : HealthWord::recalibrate;
}

}  // namespace vergence::calibration
