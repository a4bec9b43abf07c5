#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/geometry/detail/kernels.hpp"
#include "core/geometry/observations.hpp"

namespace vergence::detail {

/// Least-squares problem of T_left_world over the usable observations of a rig with constant
/// points: columns and normal equations.
///
/// Pixel of point p in camera k: X_k = R_k X_left + t_k, X_left = T_left_world p. The pose is
/// perturbed in the camera's own axes,
///
///     X_left ← Exp(φ) X_left + τ,   δ = (φ, τ),   ∂X_k/∂δ = R_k [ −[X_left]×   I ]
///
/// not about the world's origin, which is kilometres away from a vehicle, so that rotation and
/// translation would be indistinguishable.
/// Memory  In the arena at construction. Threads: one caller.
class PoseProblem {
 public:
  struct Sums {
    /// Σ w JᵀJ, undamped.
    Mat6 H;
    /// Σ w Jᵀ r.
    Vec6 g;
    /// Σ ρ.
    double cost;
  };

  PoseProblem(std::size_t capacity, Arena& arena, const char* who);

  /// Preconditions: consistent, size() ≤ capacity.
  void gather(const RigObservations& observations) noexcept;
  /// Sets whether observation i of camera k counts; all do after gather().
  void use(int camera, std::size_t i, bool counts) noexcept;
  [[nodiscard]] bool counts(int camera, std::size_t i) const noexcept {
    return sets_[static_cast<std::size_t>(camera)].weight[i] > 0.0;
  }

  [[nodiscard]] Sums sums(const Transform& T_left_world, double scale, double huber) const noexcept;
  /// Computes |r|²/σ² of every usable observation for errors(); infinity behind a camera.
  void evaluate(const Transform& T_left_world) noexcept;

  [[nodiscard]] int cameras() const noexcept { return cameras_; }
  [[nodiscard]] std::size_t count(int camera) const noexcept {
    return sets_[static_cast<std::size_t>(camera)].count;
  }
  [[nodiscard]] std::span<const double> errors(int camera) const noexcept {
    const Set& s = sets_[static_cast<std::size_t>(camera)];
    return s.error.first(s.count);
  }
  /// Index of the point of observation i.
  [[nodiscard]] std::size_t point(int camera, std::size_t i) const noexcept {
    return sets_[static_cast<std::size_t>(camera)].point[i];
  }

 private:
  struct Set {
    std::span<double> x, y, z, u, v, weight, given_weight, error;
    std::span<std::uint32_t> point;
    // Number of entries, and rounded up to whole blocks.
    std::size_t count = 0, whole = 0;
    Transform T_camera_left;
    double fx = 0, fy = 0;
  };
  [[nodiscard]] static RefineCamera camera_at(const Set& set,
                                              const Transform& T_left_world) noexcept;
  [[nodiscard]] static RefineColumns columns(const Set& set) noexcept;

  std::array<Set, kMaxCameras> sets_{};
  int cameras_ = 0;
};

/// Returns the pose perturbed by X_left ← Exp(φ) X_left + τ.
[[nodiscard]] Transform moved(const Transform& T_left_world, const Vec6& delta) noexcept;

/// Solves H δ = g. Returns false and leaves *delta unchanged if H is not positive definite or not
/// finite.
[[nodiscard]] bool solve_normal(const Mat6& H, const Vec6& g, Vec6* delta) noexcept;

}  // namespace vergence::detail
