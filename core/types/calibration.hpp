#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Maximum number of cameras on a rig; every per-frame structure is sized by it.
inline constexpr int kMaxCameras = 4;

enum class CameraModelKind : std::uint8_t {
  /// Brown–Conrady in OpenCV's order: k1 k2 p1 p2 k3.
  pinhole_radtan,
  /// Kannala–Brandt as OpenCV's fisheye model: k1 k2 k3 k4.
  pinhole_equidistant,
};

/// Intrinsics of one camera: x = K d(X/Z) in pixels, with pixel centres at integer coordinates.
struct Intrinsics {
  CameraModelKind kind = CameraModelKind::pinhole_radtan;
  /// Size of the images, in pixels.
  int width = 0;
  int height = 0;
  /// Focal lengths and principal point, in pixels.
  double fx = 0, fy = 0, cx = 0, cy = 0;
  /// Distortion coefficients in the order of CameraModelKind; unused ones are 0.
  std::array<double, 5> distortion{};
  /// Standard deviations of fx, fy, cx and cy, in pixels; 0 if unknown.
  std::array<double, 4> sigma{};
  /// Standard deviations of the distortion coefficients; 0 if unknown.
  std::array<double, 5> distortion_sigma{};

  [[nodiscard]] bool has_distortion() const noexcept {
    for (const double d : distortion)
      if (d != 0.0) return true;
    return kind != CameraModelKind::pinhole_radtan;
  }
};

/// Number of intrinsics of a camera: fx fy cx cy and five coefficients.
inline constexpr int kIntrinsicsSize = 9;
/// Number of extrinsics of a rig: φ and τ of every additional camera.
inline constexpr int kExtrinsicsSize = 6 * (kMaxCameras - 1);
/// Number of all parameters that a calibration may estimate.
inline constexpr int kRigSize = kExtrinsicsSize + kIntrinsicsSize * kMaxCameras;

/// First row of camera k's transform (k ≥ 1) and of its intrinsics among a rig's parameters.
[[nodiscard]] constexpr int extrinsic_row(int k) noexcept { return 6 * (k - 1); }
[[nodiscard]] constexpr int intrinsic_row(int k) noexcept {
  return kExtrinsicsSize + kIntrinsicsSize * k;
}

/// Joint covariance of all parameters of a rig: transforms as left perturbations (φ rad, τ m), then
/// fx fy cx cy (px) and distortion of each camera. Rows of fixed or unknown parameters are zero.
/// Symmetric; only the lower triangle is stored.
class RigCovariance {
 public:
  [[nodiscard]] double operator()(int row, int column) const noexcept {
    return packed_[place(row, column)];
  }
  void set(int row, int column, double value) noexcept { packed_[place(row, column)] = value; }
  [[nodiscard]] bool known(int row) const noexcept { return (*this)(row, row) > 0; }
  [[nodiscard]] bool empty() const noexcept {
    for (int i = 0; i < kRigSize; ++i)
      if (known(i)) return false;
    return true;
  }

 private:
  [[nodiscard]] static constexpr std::size_t place(int row, int column) noexcept {
    const auto r = static_cast<std::size_t>(row < column ? column : row),
               c = static_cast<std::size_t>(row < column ? row : column);
    return r * (r + 1) / 2 + c;
  }
  std::array<double, kRigSize*(kRigSize + 1) / 2> packed_{};
};

/// Calibration of a rig: intrinsics of every camera and its pose relative to camera 0 (`left`).
///
/// X_k = T_camera_left[k] * X_left, metres; T_camera_left[0] is the identity. Covariances are of
/// the left perturbation (rotation rad, then translation m): R ← Exp(φ)R, t ← t + τ.
struct RigCalibration {
  int cameras = 0;
  std::array<Intrinsics, kMaxCameras> intrinsics{};
  std::array<Transform, kMaxCameras> T_camera_left{};

  /// Standard deviations rx ry rz (rad) tx ty tz (m) by noise; 0 if unknown.
  std::array<std::array<double, 6>, kMaxCameras> sigma_noise{};
  /// Standard deviations including uncertain intrinsics.
  std::array<std::array<double, 6>, kMaxCameras> sigma_total{};
  /// Covariances including uncertain intrinsics; zero if unknown, which Eigen does not default to.
  std::array<Mat6, kMaxCameras> covariance_total{Mat6::Zero(), Mat6::Zero(), Mat6::Zero(),
                                                 Mat6::Zero()};
  /// Joint covariance of all parameters, from which depth errors follow; empty if unknown.
  RigCovariance covariance{};

  /// Measured length |t| of camera 1's baseline, in metres.
  double baseline = 0;
  /// Standard deviation of the baseline, in metres; 0 if exact.
  double baseline_sigma = 0;

  /// Time of the newest frame of the solve; 0 for a supplied calibration.
  Stamp found{};
  /// Number of rig frames that the calibration is based on.
  int frames = 0;
  double reprojection_px = 0;
  /// Relative standard deviation of path lengths, by the noise of the tracks and usual errors of
  /// intrinsics, without baseline_sigma.
  double scale_sigma = 0;
  /// Ratio of the actual variance to that of the solve, which weights the calibration as a prior; 0
  /// if unknown.
  double inflation = 0;
};

}  // namespace vergence
