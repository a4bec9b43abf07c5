#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "core/types/calibration.hpp"

namespace vergence {

/// Ideal pinhole of an undistorted pixel: (fx X/Z + cx, fy Y/Z + cy).
struct Pinhole {
  double fx = 0, fy = 0, cx = 0, cy = 0;  // px
};

/// World points and where the cameras of a rig see them at one instant, structure of arrays.
///
/// Ownership  Views; the memory outlives the call that reads them.
/// Units      Points in world, m. Pixels undistorted (lens model taken out), so that a pinhole is
///            exact.
/// Shape      x, y, z, sigma, seen have one length n; u[k], v[k] have length n for every camera k <
///            cameras, and what stands at i counts where bit k of seen[i] is set only.
struct RigObservations {
  int cameras = 0;
  std::array<Pinhole, kMaxCameras> pinhole{};
  std::array<Transform, kMaxCameras>
      T_camera_left{};  // X_k = T_camera_left[k] X_left; [0] identity
  std::span<const double> x, y, z;
  std::span<const double> sigma;  // px, of one coordinate, the same in all cameras; > 0
  std::span<const std::uint8_t> seen;
  std::array<std::span<const double>, kMaxCameras> u{}, v{};

  [[nodiscard]] std::size_t size() const noexcept { return x.size(); }
  [[nodiscard]] bool sees(std::size_t i, int camera) const noexcept {
    return ((seen[i] >> camera) & 1U) != 0;
  }
  /// Lengths agree, camera count in range, intrinsics and transforms finite. Entries themselves may
  /// still be anything.
  [[nodiscard]] bool consistent() const noexcept;
  /// The observation of point i in that camera can be reckoned with: finite numbers, positive
  /// finite sigma.
  [[nodiscard]] bool usable(std::size_t i, int camera) const noexcept;
};

/// Owns the arrays of RigObservations in an arena; refilled every frame. When full, push()
/// refuses.
class RigObservationTable {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  RigObservationTable(std::size_t capacity, Arena& arena);

  /// Forgets the points; keeps the rig.
  void clear() noexcept { size_ = 0; }
  /// Intrinsics and transforms of the cameras; distortion is not read. Precondition: rig.cameras in
  /// 1 … kMaxCameras.
  void set_rig(const RigCalibration& rig) noexcept;
  /// A point that no camera sees yet; its index is size() − 1 after this. False: full, nothing
  /// changed.
  [[nodiscard]] bool push(const Vec3& p_world, double sigma_px) noexcept;
  /// The last point pushed is seen by `camera` at that undistorted pixel. Precondition: size() > 0,
  /// camera of the rig.
  void see(int camera, const Vec2& pixel) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return x_.size(); }
  /// Valid until the next change.
  [[nodiscard]] RigObservations view() const noexcept;

 private:
  RigObservations rig_{};  // cameras, pinholes, transforms; no arrays
  std::span<double> x_, y_, z_, sigma_;
  std::span<std::uint8_t> seen_;
  std::array<std::span<double>, kMaxCameras> u_{}, v_{};
  std::size_t size_ = 0;
};

}  // namespace vergence
