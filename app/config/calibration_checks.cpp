#include "app/config/calibration_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "core/math/linear_solve.hpp"

namespace vergence::app {
namespace {

// Limits of an image side in px.
constexpr int kSmallestImage = 16, kLargestImage = 16384;
// Focal length over the larger side: 0.2 is wider than any fisheye lens, 5 a telephoto lens of 11°.
constexpr double kShortestFocal = 0.2, kLongestFocal = 5.0;
// Maximum of fx : fy; half-height (interlaced) images have 2.
constexpr double kLargestAspect = 2.0;
// Shift of a corner of the image by the lens, as a part of its distance from the centre. Strong
// wide-angle lenses reach 0.4.
constexpr double kLargestDistortion = 0.8;
// A rotation is used unchanged if no entry of RᵀR − I exceeds this.
constexpr double kSameRotation = 1e-6;
// Up to this entry of RᵀR − I the nearest rotation is used; a larger one is refused.
constexpr double kNearRotation = 1e-3;
// Baselines in m outside these limits indicate a wrong unit.
constexpr double kShortestBaseline = 0.005, kLongestBaseline = 20;
// Relative tolerance, in addition to four sigmas of the measured length.
constexpr double kBaselineTolerance = 0.02;

// Tolerance for a correlation and for the smallest eigenvalue of the correlation matrix: the
// rounding error of numbers with nine digits.
constexpr double kRounding = 1e-6;

using Finding = std::optional<ValidationError>;

template <class... Args>
Finding finding(const std::string& field, fmt::format_string<Args...> message, Args&&... args) {
  return ValidationError{field, field + " " + fmt::format(message, std::forward<Args>(args)...)};
}

template <class Numbers>
bool all_finite(const Numbers& numbers) {
  return std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); });
}

template <class Numbers>
Finding check_sigmas(const Numbers& sigmas, const std::string& field) {
  if (!all_finite(sigmas)) return finding(field, "holds a number that is not finite");
  if (std::ranges::any_of(sigmas, [](double v) { return v < 0; }))
    return finding(field, "holds a negative sigma");
  return std::nullopt;
}

/// Returns how far the lens moves the image's farthest corner, as a part of its distance from the
/// principal point. The model is evaluated at the distorted radius, which needs no inversion: good
/// to the factor that the limit leaves.
double corner_distortion(const Intrinsics& k) {
  const double x = std::max(k.cx, k.width - 1 - k.cx) / k.fx,
               y = std::max(k.cy, k.height - 1 - k.cy) / k.fy;
  const double r2 = x * x + y * y, r = std::sqrt(r2);
  const auto& d = k.distortion;
  if (k.kind == CameraModelKind::pinhole_equidistant)
    return std::abs(r2 * (d[0] + r2 * (d[1] + r2 * (d[2] + r2 * d[3]))));
  return std::abs(r2 * (d[0] + r2 * (d[1] + r2 * d[4]))) + 3.0 * r * std::hypot(d[2], d[3]);
}

Finding check_intrinsics(const Intrinsics& k, const std::string& camera) {
  if (std::min(k.width, k.height) < kSmallestImage || std::max(k.width, k.height) > kLargestImage)
    return finding(camera + "size", "is {} x {} px; sides of {} to {} are expected", k.width,
                   k.height, kSmallestImage, kLargestImage);
  const std::string intrinsics = camera + "intrinsics";
  if (!all_finite(std::array{k.fx, k.fy, k.cx, k.cy}))
    return finding(intrinsics, "holds a number that is not finite");
  const double side = std::max(k.width, k.height);
  for (const double f : {k.fx, k.fy})
    if (f < kShortestFocal * side || f > kLongestFocal * side)
      return finding(intrinsics,
                     "has the focal length {} px; an image of {} x {} needs a positive one of {:g} "
                     "to {:g} px (the order is fx, fy, cx, cy)",
                     f, k.width, k.height, kShortestFocal * side, kLongestFocal * side);
  if (std::max(k.fx, k.fy) > kLargestAspect * std::min(k.fx, k.fy))
    return finding(intrinsics,
                   "has focal lengths as different as {} and {} (the order is fx, fy, cx, cy)",
                   k.fx, k.fy);
  if (k.cx < 0 || k.cy < 0 || k.cx > k.width - 1 || k.cy > k.height - 1)
    return finding(intrinsics,
                   "has its principal point ({}, {}) outside the image of {} x {} (the order is "
                   "fx, fy, cx, cy)",
                   k.cx, k.cy, k.width, k.height);
  if (!all_finite(k.distortion))
    return finding(camera + "distortion", "holds a number that is not finite");
  const double shift = corner_distortion(k);
  if (!(shift <= kLargestDistortion))
    return finding(camera + "distortion",
                   "would move a corner of the image by {:.3g} of its distance from the centre; up "
                   "to {} is expected (radtan: k1, k2, p1, p2[, k3]; equidistant: k1 to k4)",
                   shift, kLargestDistortion);
  if (auto bad = check_sigmas(k.sigma, camera + "intrinsics_sigma")) return bad;
  return check_sigmas(k.distortion_sigma, camera + "distortion_sigma");
}

Finding check_rotation(Mat3* R, const std::string& field) {
  const double off = (R->transpose() * *R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(off < kNearRotation))
    return finding(field,
                   "has a rotation that is not orthonormal (RᵀR is off the identity by {:.2g}, up "
                   "to {:.0e} is repaired); are rows and columns in order (r11 r12 r13 t1, r21 …)?",
                   off, kNearRotation);
  if (R->determinant() < 0)
    return finding(field,
                   "has a rotation that mirrors (determinant -1); check the signs of its rows");
  if (off > kSameRotation) {
    const Svd3 s = svd(*R);
    *R = s.U * s.V.transpose();
  }
  return std::nullopt;
}

Finding check_transform(Transform* T, const std::string& field) {
  if (!T->finite()) return finding(field, "holds a number that is not finite");
  if (auto bad = check_rotation(&T->R, field)) return bad;
  const double length = T->t.norm();
  if (length < kShortestBaseline || length > kLongestBaseline)
    return finding(field,
                   "puts the camera {:g} m from the left one; {} to {} m are expected (the "
                   "translation is in metres)",
                   length, kShortestBaseline, kLongestBaseline);
  return std::nullopt;
}

/// Camera 1 by the length that was measured and by its side. X_right = R X_left + t.
Finding check_baseline(const RigCalibration& rig) {
  const Vec3& t = rig.T_camera_left[1].t;
  if (!std::isfinite(rig.baseline) || rig.baseline < 0)
    return finding("rig.baseline", "must be a positive number of metres");
  if (auto bad = check_sigmas(std::array{rig.baseline_sigma}, "rig.baseline_sigma")) return bad;
  const double tolerance = kBaselineTolerance * t.norm() + 4.0 * rig.baseline_sigma;
  if (rig.baseline > 0 && std::abs(rig.baseline - t.norm()) > tolerance)
    return finding(
        "rig.baseline",
        "is {:g} m, but cameras.1.T_camera_left has a translation of {:g} m; correct one of them",
        rig.baseline, t.norm());
  // Where camera 1 is, in the axes of camera 0: t has those of camera 1, which may be mounted
  // upside down.
  const Vec3 centre = -(rig.T_camera_left[1].R.transpose() * t);
  if (centre.x() < -0.5 * centre.norm())
    return finding("cameras.1.T_camera_left",
                   "puts camera 1 {:g} m to the left of camera 0: left and right are swapped, or "
                   "the transform is given as its inverse (X_camera = R "
                   "X_left + t, so a parallel camera on the right has t1 < 0)",
                   -centre.x());
  return std::nullopt;
}

}  // namespace

std::string baseline_message(const RigCalibration& rig) {
  return fmt::format("the baseline is {:.4g} m", rig.T_camera_left[1].t.norm());
}

std::string baseline_warning(const RigCalibration& rig) {
  // Usual limits in m.
  constexpr double kUsuallyShortest = 0.02, kUsuallyLongest = 2;
  const double length = rig.T_camera_left[1].t.norm();
  if (length >= kUsuallyShortest && length <= kUsuallyLongest) return "";
  return fmt::format(
      "a baseline of {:.4g} m is unusually {}; check that the calibration is in metres, not in {}",
      length, length < kUsuallyShortest ? "short" : "long",
      length < kUsuallyShortest ? "another"
                                : "centimetres, millimetres or squares of a calibration target");
}

std::optional<ValidationError> find_implausible(RigCalibration* rig) {
  if (rig->cameras < 2 || rig->cameras > kMaxCameras)
    return finding("cameras", "lists {} cameras; a rig has 2 to {}", rig->cameras, kMaxCameras);
  for (int k = 0; k < rig->cameras; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const std::string camera = fmt::format("cameras.{}.", k);
    if (auto bad = check_intrinsics(rig->intrinsics[i], camera)) return bad;
    if (k == 0) continue;
    if (auto bad = check_transform(&rig->T_camera_left[i], camera + "T_camera_left")) return bad;
    if (auto bad = check_sigmas(rig->sigma_noise[i], camera + "sigma_noise")) return bad;
    if (auto bad = check_sigmas(rig->sigma_total[i], camera + "sigma_total")) return bad;
    const std::string field = camera + "covariance_total";
    const Mat6& covariance = rig->covariance_total[i];
    if (!covariance.allFinite()) return finding(field, "holds a number that is not finite");
    if (covariance.diagonal().minCoeff() < 0)
      return finding(field, "has a negative variance on its diagonal");
  }
  if (const auto flaw = find_flaw(rig->covariance)) return finding("covariance", "{}", *flaw);
  if (auto bad = check_baseline(*rig)) return bad;
  if (rig->frames < 0) return finding("found.frames", "is negative");
  if (auto bad = check_sigmas(std::array{rig->reprojection_px}, "found.reprojection_px"))
    return bad;
  if (auto bad = check_sigmas(std::array{rig->scale_sigma}, "found.scale_sigma")) return bad;
  if (!std::isfinite(rig->inflation) || rig->inflation < 0)
    return finding("found.inflation", "must be a number from 0 on");
  return std::nullopt;
}

std::optional<std::string> find_flaw(const RigCovariance& covariance) {
  for (int i = 0; i < kRigSize; ++i)
    for (int j = 0; j <= i; ++j) {
      const double value = covariance(i, j);
      if (!std::isfinite(value)) return "holds a number that is not finite";
      if (i == j && value < 0) return "has a negative variance";
      if (value != 0 && !(covariance.known(i) && covariance.known(j)))
        return "correlates a parameter with one that has no variance";
    }
  std::vector<int> rows(kRigSize);
  std::iota(rows.begin(), rows.end(), 0);
  std::erase_if(rows, [&](int row) { return !covariance.known(row); });
  const auto n = std::ssize(rows);
  if (n == 0) return std::nullopt;
  // Correlations: rad, m and px in one matrix would hide what the small ones do.
  Eigen::MatrixXd correlation = Eigen::MatrixXd::NullaryExpr(n, n, [&](auto i, auto j) {
    const int a = rows[static_cast<std::size_t>(i)], b = rows[static_cast<std::size_t>(j)];
    return covariance(a, b) / std::sqrt(covariance(a, a)) / std::sqrt(covariance(b, b));
  });
  if (!(correlation.cwiseAbs().maxCoeff() <= 1 + kRounding)) return "has a correlation beyond 1";
  // No eigenvalue is below −kRounding.
  correlation.diagonal().array() += kRounding;
  if (!positive_definite(correlation))
    return "is not positive semidefinite: some combination of its parameters has a negative "
           "variance";
  return std::nullopt;
}

}  // namespace vergence::app
