#include "core/calibration/detail/depth.hpp"

#include <cmath>

#include <Eigen/LU>

#include "core/math/so3.hpp"

namespace vergence::calibration::detail {
namespace {

// Number of Newton steps, which reduce an error of a few percent to rounding.
constexpr int kDepthSteps = 4;

}  // namespace

DepthGradient depth_gradient(const CovisiblePoint& p, const Transform& T, int k,
                             bool lenses) noexcept {
  // The right pixel moves by by_depth per metre, by G (−[R X]×, I) per error of the transform, by
  // ∂x/∂intrinsics per error of the right intrinsics, and with the ray per error of the left ones.
  // The depth of a match absorbs the component along the epipolar line.
  const Vec2 along = -p.by_depth / (p.by_depth.squaredNorm() * p.depth_m);
  DepthGradient g;
  Mat26 by_rig;
  by_rig << -p.G * skew(Vec3(p.X - T.t)), p.G;
  for (int i = 0; i < 6; ++i) g.add(extrinsic_row(k) + i, along.dot(by_rig.col(i)));
  if (!lenses) return g;
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

double depth_variance(const RigCalibration& rig, int k, const DepthGradient& g,
                      bool joint) noexcept {
  double sum = 0;
  const auto n = static_cast<std::size_t>(g.count), c = static_cast<std::size_t>(k);
  if (joint) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        sum += g.by[i] * g.by[j] * rig.covariance(g.row[i], g.row[j]);
    return sum;
  }
  const bool full = rig.covariance_total[c].squaredNorm() > 0;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) {
      const double of_sigma = i == j ? rig.sigma_total[c][i] * rig.sigma_total[c][i] : 0.0;
      sum += g.by[i] * g.by[j] *
             (full ? rig.covariance_total[c](static_cast<int>(i), static_cast<int>(j)) : of_sigma);
    }
  return sum;
}

DepthReader::DepthReader(const RigCalibration& rig, int k) noexcept
    : left_(rig.intrinsics[0]),
      right_(rig.intrinsics[static_cast<std::size_t>(k)]),
      T_(rig.T_camera_left[static_cast<std::size_t>(k)]) {}

bool DepthReader::difference(const CovisiblePoint& p, double* relative) const noexcept {
  Vec3 ray;
  if (!left_.unproject(p.pixel, &ray)) return false;
  // Find the point on the own ray that projects nearest to the match, by its inverse depth, so that
  // points beyond infinity have a projection too.
  double inverse = 1.0 / p.depth_m;
  for (int step = 0; step < kDepthSteps; ++step) {
    Vec2 at;
    Mat23 G;
    if (right_.project(T_.R * ray + inverse * T_.t, &at, &G) != ProjectStatus::ok) return false;
    const Vec2 by_inverse = G * T_.t;
    inverse += by_inverse.dot(p.at - at) / by_inverse.squaredNorm();
  }
  *relative = inverse * p.depth_m - 1.0;
  return std::isfinite(*relative);
}

}  // namespace vergence::calibration::detail
