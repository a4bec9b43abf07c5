#include "core/calibration/health.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/camera/camera.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {
namespace {

// Number of grid points along each side of the image.
constexpr int kDepthGrid = 7;
// Number of Newton steps, which reduce an error of a few percent to rounding.
constexpr int kDepthSteps = 4;

/// A pixel of the left image, a depth, and the projection of that point into camera k.
struct CovisiblePoint {
  const Camera* left = nullptr;
  const Camera* right = nullptr;
  double depth_m = 0;
  Vec2 pixel = Vec2::Zero();
  /// Left ray (x, y, 1).
  Vec3 ray = Vec3::Zero();
  /// Point in the frame of camera k, in metres.
  Vec3 X = Vec3::Zero();
  /// Pixel in camera k's image.
  Vec2 at = Vec2::Zero();
  /// Derivative of `at` with respect to X, in px/m.
  Mat23 G = Mat23::Zero();
  /// Derivative of `at` with respect to the depth, in px/m.
  Vec2 by_depth = Vec2::Zero();
};

/// Root mean square, in percent, of what square(place, &value) gives for those points of a grid
/// that both cameras see at a depth; 0 without any. Points for which it returns false do not count.
template <class Square>
double rms_percent(const RigCalibration& rig, std::size_t k, double depth_m,
                   Square square) noexcept {
  const Transform& T = rig.T_camera_left[k];
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[k]);
  double sum = 0;
  int seen = 0;
  for (int row = 0; row < kDepthGrid; ++row) {
    for (int column = 0; column < kDepthGrid; ++column) {
      CovisiblePoint p{.left = &left, .right = &right, .depth_m = depth_m};
      p.pixel = {(column + 0.5) / kDepthGrid * rig.intrinsics[0].width,
                 (row + 0.5) / kDepthGrid * rig.intrinsics[0].height};
      if (!left.unproject(p.pixel, &p.ray)) continue;
      p.X = T * (p.ray * depth_m);
      if (right.project(p.X, &p.at, &p.G) != ProjectStatus::ok || !right.inside(p.at, 0.0))
        continue;
      p.by_depth = p.G * (T.R * p.ray);
      double value = 0;
      if (!(p.by_depth.squaredNorm() > 0) || !square(p, &value)) continue;
      sum += value;
      ++seen;
    }
  }
  return seen == 0 ? 0.0 : 100.0 * std::sqrt(std::max(0.0, sum / seen));
}

/// Derivatives of a relative depth with respect to a rig's parameters, as rows of RigCovariance and
/// their factors.
struct DepthGradient {
  std::array<int, 6 + 2 * kIntrinsicsSize> row;
  std::array<double, 6 + 2 * kIntrinsicsSize> by;
  std::size_t count = 0;

  void add(int r, double value) noexcept {
    row[count] = r;
    by[count++] = value;
  }
};

/// `joint`: includes the intrinsics, otherwise only the transform.
DepthGradient depth_gradient(const CovisiblePoint& p, const Transform& T, int k,
                             bool joint) noexcept {
  // The right pixel moves by by_depth per metre, by G (−[R X]×, I) per error of the transform, by
  // ∂x/∂intrinsics per error of the right intrinsics, and with the ray per error of the left ones.
  // The depth of a match absorbs the component along the epipolar line.
  const Vec2 along = -p.by_depth / (p.by_depth.squaredNorm() * p.depth_m);
  DepthGradient g;
  Mat26 by_rig;
  by_rig << -p.G * skew(Vec3(p.X - T.t)), p.G;
  for (int i = 0; i < 6; ++i) g.add(extrinsic_row(k) + i, along.dot(by_rig.col(i)));
  if (!joint) return g;
  const auto by_right = p.right->intrinsics_jacobian(p.X);
  for (int i = 0; i < kIntrinsicsSize; ++i) g.add(intrinsic_row(k) + i, along.dot(by_right.col(i)));
  Vec2 unused;
  Mat23 G_left;
  if (p.left->project(p.ray, &unused, &G_left) != ProjectStatus::ok) return g;
  // The left pixel is fixed, so a change of the intrinsics moves the ray by the negative change of
  // the pixel through the inverse projection.
  const Eigen::Matrix<double, 2, 9> ray_by_left =
      -G_left.leftCols<2>().inverse() * p.left->intrinsics_jacobian(p.ray);
  const Mat2 by_ray = p.depth_m * (p.G * T.R.leftCols<2>());
  for (int i = 0; i < kIntrinsicsSize; ++i)
    g.add(intrinsic_row(0) + i, along.dot(by_ray * ray_by_left.col(i)));
  return g;
}

/// Variance of the relative depth; without `joint` only by the transform's covariance_total or, if
/// that is zero, sigma_total.
double depth_variance(const RigCalibration& rig, std::size_t k, const DepthGradient& g,
                      bool joint) noexcept {
  const bool full = rig.covariance_total[k].squaredNorm() > 0;
  const auto covariance = [&](std::size_t i, std::size_t j) noexcept {
    if (joint) return rig.covariance(g.row[i], g.row[j]);
    if (full) return rig.covariance_total[k](static_cast<int>(i), static_cast<int>(j));
    return i == j ? rig.sigma_total[k][i] * rig.sigma_total[k][i] : 0.0;
  };
  double sum = 0;
  for (std::size_t i = 0; i < g.count; ++i)
    for (std::size_t j = 0; j < g.count; ++j) sum += g.by[i] * g.by[j] * covariance(i, j);
  return sum;
}

/// Computes the relative excess of the inverse depth that a rig gives to the place's two pixels.
/// Returns false if they are outside its lens models.
bool depth_difference(const Camera& left, const Camera& right, const Transform& T,
                      const CovisiblePoint& p, double* relative) noexcept {
  Vec3 ray;
  if (!left.unproject(p.pixel, &ray)) return false;
  // Find the point on the left ray that projects nearest to the match. The inverse depth is used
  // because it also describes points beyond infinity.
  double inverse = 1.0 / p.depth_m;
  for (int step = 0; step < kDepthSteps; ++step) {
    Vec2 at;
    Mat23 G;
    if (right.project(T.R * ray + inverse * T.t, &at, &G) != ProjectStatus::ok) return false;
    const Vec2 by_inverse = G * T.t;
    inverse += by_inverse.dot(p.at - at) / by_inverse.squaredNorm();
  }
  *relative = inverse * p.depth_m - 1.0;
  return std::isfinite(*relative);
}

}  // namespace

double depth_error_percent(const RigCalibration& rig, int k, double depth_m) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const bool joint = !rig.covariance.empty();
  return rms_percent(rig, c, depth_m, [&](const CovisiblePoint& p, double* variance) noexcept {
    *variance = depth_variance(rig, c, depth_gradient(p, rig.T_camera_left[c], k, joint), joint);
    return true;
  });
}

double depth_error_percent(const RigCalibration& measured, const RigCalibration& current, int k,
                           double depth_m) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const Camera left(current.intrinsics[0]), right(current.intrinsics[c]);
  return rms_percent(measured, c, depth_m, [&](const CovisiblePoint& p, double* square) noexcept {
    double relative = 0;
    if (!depth_difference(left, right, current.T_camera_left[c], p, &relative)) return false;
    *square = relative * relative;
    return true;
  });
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

std::string_view rating(const RigCalibration& rig, const CalibrationOptions& options) noexcept {
  const double error = depth_error_percent(rig, kRatingDepth);
  if (error <= options.good_depth_percent) return "good";
  return error <= options.usable_depth_percent ? "fair" : "poor";
}

}  // namespace vergence::calibration
