#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Cameras on one rig; fixed, because every per-frame structure is sized by it.
inline constexpr int kMaxCameras = 4;

enum class CameraModelKind : std::uint8_t {
  pinhole_radtan,       // k1 k2 p1 p2 k3 (Brown–Conrady, OpenCV's order)
  pinhole_equidistant,  // k1 k2 k3 k4 (Kannala–Brandt, OpenCV's fisheye)
};

/// One camera's image formation: x = K d(X/Z), pixels; pixel centres at integer coordinates.
struct Intrinsics {
  CameraModelKind kind = CameraModelKind::pinhole_radtan;
  int width = 0;                             // px
  int height = 0;                            // px
  double fx = 0, fy = 0, cx = 0, cy = 0;     // px
  std::array<double, 5> distortion{};        // radtan: k1 k2 p1 p2 k3; equidistant: k1 k2 k3 k4, 0
  std::array<double, 4> sigma{};             // of fx fy cx cy, px; 0: not given
  std::array<double, 5> distortion_sigma{};  // of the coefficients; 0: not given

  [[nodiscard]] bool has_distortion() const noexcept {
    for (const double d : distortion)
      if (d != 0.0) return true;
    return kind != CameraModelKind::pinhole_radtan;
  }
};

inline constexpr int kIntrinsicsSize = 9;                      // fx fy cx cy d0 … d4
inline constexpr int kExtrinsicsSize = 6 * (kMaxCameras - 1);  // φ, τ of every further camera
inline constexpr int kRigSize =
    kExtrinsicsSize + kIntrinsicsSize * kMaxCameras;  // all that a calibration may estimate

/// First row of camera k's transform (k ≥ 1) and of its intrinsics among a rig's parameters.
[[nodiscard]] constexpr int extrinsic_row(int k) noexcept { return 6 * (k - 1); }
[[nodiscard]] constexpr int intrinsic_row(int k) noexcept {
  return kExtrinsicsSize + kIntrinsicsSize * k;
}

/// Covariance of all of a rig's parameters together: transforms as left perturbations (φ rad, τ m),
/// then fx fy cx cy (px) and distortion of each camera. Zero rows: held, or not known. Symmetric;
/// the lower triangle is kept.
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

/// A rig: intrinsics of every camera and where each sits relative to camera 0 (`left`).
///
/// X_k = T_camera_left[k] * X_left, metres; T_camera_left[0] is the identity. Covariances are of
/// the left perturbation (rotation rad, then translation m): R ← Exp(φ)R, t ← t + τ.
struct RigCalibration {
  int cameras = 0;
  std::array<Intrinsics, kMaxCameras> intrinsics{};
  std::array<Transform, kMaxCameras> T_camera_left{};
  std::array<std::array<double, 6>, kMaxCameras>
      sigma_noise{};  // rx ry rz (rad) tx ty tz (m); 0: not given
  std::array<std::array<double, 6>, kMaxCameras>
      sigma_total{};  // the same with uncertain intrinsics
  // zero: not given (Eigen leaves a Mat6 without initialiser undefined)
  std::array<Mat6, kMaxCameras> covariance_total{Mat6::Zero(), Mat6::Zero(), Mat6::Zero(),
                                                 Mat6::Zero()};
  RigCovariance covariance{};  // of all parameters together, wide: what a depth is off by follows
                               // from it; empty: not given
  double baseline = 0;         // m, |t| of camera 1 as measured once
  double baseline_sigma = 0;   // m; 0: exact

  Stamp found{};               // when the stereo transform was found; 0: given
  int frames = 0;              // rig frames it was found from, all that its information is of
  double reprojection_px = 0;  // root mean square of that solve
  double scale_sigma = 0;  // relative, of lengths driven: by the noise of the tracks it was found
                           // from, and by what lenses usually are off; not by baseline_sigma
  double inflation = 0;    // variance of the result over the variance by its solve: weighs it as
                           // the next one's prior; 0: not known
};

}  // namespace vergence
