#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "core/types/calibration.hpp"

namespace vergence {

/// Ideal pinhole camera of undistorted pixels: (fx X/Z + cx, fy Y/Z + cy), in px.
struct Pinhole {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// World points and their observations by the cameras of a rig at one instant, as structure of
/// arrays.
///
/// Ownership  Views; the memory outlives the call that reads them.
/// Units      Points in world, m. Pixels are undistorted, so that a pinhole is exact.
/// Shape      x, y, z, sigma, seen have one length n; u[k], v[k] have length n for every camera k <
///            cameras, whose element i is valid only if bit k of seen[i] is set.
struct RigObservations {
  int cameras = 0;
  std::array<Pinhole, kMaxCameras> pinhole{};
  /// X_k = T_camera_left[k] X_left; element 0 is the identity.
  std::array<Transform, kMaxCameras> T_camera_left{};
  std::span<const double> x, y, z;
  /// Standard deviation of one coordinate in px, the same in all cameras; > 0.
  std::span<const double> sigma;
  std::span<const std::uint8_t> seen;
  std::array<std::span<const double>, kMaxCameras> u{}, v{};

  [[nodiscard]] std::size_t size() const noexcept { return x.size(); }
  [[nodiscard]] bool sees(std::size_t i, int camera) const noexcept {
    return ((seen[i] >> camera) & 1U) != 0;
  }
  /// True if lengths agree, the number of cameras is in range, and intrinsics and transforms are
  /// finite. Entries may still have any value.
  [[nodiscard]] bool consistent() const noexcept;
  /// True if the observation of point i in that camera has finite numbers and a positive finite
  /// sigma.
  [[nodiscard]] bool usable(std::size_t i, int camera) const noexcept;
};

/// Owns the arrays of RigObservations in an arena; refilled every frame.
class RigObservationTable {
 public:
  RigObservationTable(std::size_t capacity, Arena& arena);

  /// Clears the points; keeps the rig.
  void clear() noexcept { size_ = 0; }
  /// Sets intrinsics and transforms of the cameras; distortion is not read. Precondition:
  /// rig.cameras in 1 … kMaxCameras.
  void set_rig(const RigCalibration& rig) noexcept;
  /// Adds a point without observations, at index size() − 1. Returns false if the table is full.
  [[nodiscard]] bool push(const Vec3& p_world, double sigma_px) noexcept;
  /// Adds the observation of the last point by `camera` at an undistorted pixel. Precondition:
  /// size() > 0, camera of the rig.
  void see(int camera, const Vec2& pixel) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return x_.size(); }
  /// Valid until the next change.
  [[nodiscard]] RigObservations view() const noexcept;

 private:
  // Cameras, pinholes and transforms; the arrays are empty.
  RigObservations rig_{};
  std::span<double> x_, y_, z_, sigma_;
  std::span<std::uint8_t> seen_;
  std::array<std::span<double>, kMaxCameras> u_{}, v_{};
  std::size_t size_ = 0;
};

}  // namespace vergence
