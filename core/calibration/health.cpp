#include "core/calibration/health.hpp"

#include <algorithm>
#include <cmath>

#include "core/camera/camera.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {
namespace {

constexpr int kGrid = 7;           // directions a side
constexpr double kWordDepth = 20;  // m
constexpr int kDepthSteps = 4;     // of Newton: from a few percent off to rounding

/// Derivatives of a relative depth by a rig's parameters: the rows of RigCovariance that it has and their factors.
struct DepthGradient {
  std::array<int, 6 + 2 * kIntrinsicsSize> row;
  std::array<double, 6 + 2 * kIntrinsicsSize> by;
  int count = 0;

  void add(int r, double value) noexcept {
    row[static_cast<std::size_t>(count)] = r;
    by[static_cast<std::size_t>(count++)] = value;
  }
};

/// Variance of the relative depth at one place; without a joint covariance that of the transform alone.
double variance_of(const RigCalibration& rig, std::size_t k, const DepthGradient& g, bool joint) noexcept {
  double sum = 0;
  const auto n = static_cast<std::size_t>(g.count);
  if (joint) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) sum += g.by[i] * g.by[j] * rig.covariance(g.row[i], g.row[j]);
    return sum;
  }
  const bool full = rig.covariance_wide[k].squaredNorm() > 0;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) {
      const double c = full ? rig.covariance_wide[k](static_cast<int>(i), static_cast<int>(j))
                       : i == j ? rig.sigma_wide[k][i] * rig.sigma_wide[k][i]
                                : 0.0;
      sum += g.by[i] * g.by[j] * c;
    }
  return sum;
}

/// A place of the left image and what the right camera makes of a point there.
struct SeenByBoth {
  Vec3 ray;      // left, (x, y, 1)
  Vec2 at;       // right pixel
  Vec2 by_depth; // ∂at/∂depth, px/m
};

/// Calls each(place, left camera, right camera, X in the right camera) for a grid of places that both cameras see at a depth.
template <class Each>
void for_places(const RigCalibration& rig, int k, double depth_m, Each each) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const Transform& T = rig.T_camera_left[c];
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[c]);
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      SeenByBoth place;
      const Vec2 pixel((column + 0.5) / kGrid * rig.intrinsics[0].width, (row + 0.5) / kGrid * rig.intrinsics[0].height);
      if (!left.unproject(pixel, &place.ray)) continue;
      const Vec3 X = T * (place.ray * depth_m);
      Mat23 G;
      if (right.project(X, &place.at, &G) != ProjectStatus::ok || !right.inside(place.at, 0.0)) continue;
      place.by_depth = G * (T.R * place.ray);
      if (place.by_depth.squaredNorm() > 0) each(place, left, right, X, G);
    }
  }
}

}  // namespace

std::string_view to_string(HealthWord word) noexcept {
  static constexpr std::array<std::string_view, 3> names = {"good", "can be improved", "recalibrate"};
  return names[static_cast<std::size_t>(word)];
}

double depth_error_percent(const RigCalibration& rig, int k, double depth_m) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const Transform& T = rig.T_camera_left[c];
  const bool joint = !rig.covariance.empty();
  double sum = 0;
  int seen = 0;
  for_places(rig, k, depth_m, [&](const SeenByBoth& p, const Camera& left, const Camera& right, const Vec3& X, const Mat23& G) noexcept {
    // The right pixel moves by by_depth per metre and by G (−[R X]×, I) per error of the transform, by ∂x/∂intrinsics per error of the
    // right lens, and by by_depth's like along the two axes of the ray per error of the left one: the depth that a match then gives is
    // the one that takes up the part along the epipolar line.
    const Vec2 along = -p.by_depth / (p.by_depth.squaredNorm() * depth_m);
    DepthGradient g;
    Mat26 by_rig;
    by_rig << -G * skew(Vec3(X - T.t)), G;
    for (int i = 0; i < 6; ++i) g.add(extrinsic_row(k) + i, along.dot(by_rig.col(i)));
    if (joint) {
      const auto by_right = right.intrinsics_jacobian(X);
      for (int i = 0; i < kIntrinsicsSize; ++i) g.add(intrinsic_row(k) + i, along.dot(by_right.col(i)));
      Vec2 unused;
      Mat23 G_left;
      if (left.project(p.ray, &unused, &G_left) != ProjectStatus::ok) return;
      // Of a pixel that is held, the ray moves against what the lens would have moved the pixel by.
      const Eigen::Matrix<double, 2, 9> ray_by_left = -G_left.leftCols<2>().inverse() * left.intrinsics_jacobian(p.ray);
      const Mat2 by_ray = depth_m * (G * T.R.leftCols<2>());
      for (int i = 0; i < kIntrinsicsSize; ++i) g.add(intrinsic_row(0) + i, along.dot(by_ray * ray_by_left.col(i)));
    }
    sum += variance_of(rig, c, g, joint);
    ++seen;
  });
  return seen == 0 ? 0.0 : 100.0 * std::sqrt(std::max(0.0, sum / seen));
}

double depth_difference_percent(const RigCalibration& measured, const RigCalibration& claimed, int k, double depth_m) noexcept {
  const auto c = static_cast<std::size_t>(k);
  const Camera claimed_left(claimed.intrinsics[0]), claimed_right(claimed.intrinsics[c]);
  const Transform& T = claimed.T_camera_left[c];
  double sum = 0;
  int seen = 0;
  for_places(measured, k, depth_m, [&](const SeenByBoth& p, const Camera& left, const Camera&, const Vec3&, const Mat23&) noexcept {
    // The same two pixels as the claimed calibration reads them: where along its own ray is the point that projects nearest to the match?
    Vec2 pixel, at;
    Vec3 ray;
    if (left.project(p.ray, &pixel, nullptr) != ProjectStatus::ok || !claimed_left.unproject(pixel, &ray)) return;
    Mat23 G;
    double inverse = 1.0 / depth_m;
    for (int step = 0; step < kDepthSteps; ++step) {
      const Vec3 X = T.R * ray + inverse * T.t;  // in units of the depth: the projection is the same, also of what lies beyond infinity
      if (claimed_right.project(X, &at, &G) != ProjectStatus::ok) return;
      const Vec2 by_inverse = G * T.t;
      inverse += by_inverse.dot(p.at - at) / by_inverse.squaredNorm();
    }
    const double relative = inverse * depth_m - 1.0;  // of the inverse depth: finite also where the claim puts a point at infinity
    sum += relative * relative;
    ++seen;
  });
  return seen == 0 ? 0.0 : 100.0 * std::sqrt(sum / seen);
}

double judged_depth_m(const RigCalibration& rig, int k, const CalibrationOptions& options, double pixel_sigma) noexcept {
  const auto c = static_cast<std::size_t>(k);
  constexpr double kOfTolerance = 0.5;  // the share of it that a single match's noise takes
  const double tolerated_px = std::sqrt(2.0) * pixel_sigma / (kOfTolerance * 0.01 * options.tolerated_depth_percent);
  return std::min(options.tolerated_depth_m, rig.intrinsics[0].fx * rig.T_camera_left[c].t.norm() / tolerated_px);
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
