#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/geometry/detail/kernels.hpp"
#include "core/geometry/observations.hpp"

namespace vergence::detail {

/// Least squares of T_left_world over the usable observations of a rig, points constant: columns
/// and normal equations.
///
/// Pixel of point p in camera k: X_k = R_k X_left + t_k, X_left = T_left_world p. The pose is moved
/// in the camera's own axes,
///
///     X_left ← Exp(φ) X_left + τ,   δ = (φ, τ),   ∂X_k/∂δ = R_k [ −[X_left]×   I ]
///
/// not about the world's origin, which lies kilometres behind a vehicle: there rotation and
/// translation would be the same thing.
/// Memory  In the arena at construction. Threads: one caller.
class PoseProblem {
 public:
  struct Sums {
    Mat6 H;       // Σ w JᵀJ, undamped
    Vec6 g;       // Σ w Jᵀ r
    double cost;  // Σ ρ
  };

  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  PoseProblem(std::size_t capacity, Arena& arena, const char* who);

  /// Preconditions: consistent, size() ≤ capacity.
  void gather(const RigObservations& observations) noexcept;
  /// Observation i of camera k counts (or not) from now on; all count after gather().
  void use(int camera, std::size_t i, bool counts) noexcept;
  [[nodiscard]] bool counts(int camera, std::size_t i) const noexcept {
    return sets_[static_cast<std::size_t>(camera)].weight[i] > 0.0;
  }

  [[nodiscard]] Sums sums(const Transform& T_left_world, double scale, double huber) const noexcept;
  /// |r|²/σ² of every usable observation, infinity behind a camera; read back by errors().
  void evaluate(const Transform& T_left_world) noexcept;

  [[nodiscard]] int cameras() const noexcept { return cameras_; }
  [[nodiscard]] std::size_t count(int camera) const noexcept {
    return sets_[static_cast<std::size_t>(camera)].count;
  }
  [[nodiscard]] std::size_t observations() const noexcept;
  [[nodiscard]] std::span<const double> errors(int camera) const noexcept {
    const Set& s = sets_[static_cast<std::size_t>(camera)];
    return s.error.first(s.count);
  }
  /// Index of the point that observation i of that camera is of.
  [[nodiscard]] std::size_t point(int camera, std::size_t i) const noexcept {
    return sets_[static_cast<std::size_t>(camera)].point[i];
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return sets_[0].point.size(); }

 private:
  struct Set {
    std::span<double> x, y, z, u, v, weight, given_weight, error;
    std::span<std::uint32_t> point;
    std::size_t count = 0, whole = 0;  // used, and rounded up to whole blocks
    Transform T_camera_left;
    double fx = 0, fy = 0;
  };
  [[nodiscard]] static RefineCamera camera_at(const Set& set,
                                              const Transform& T_left_world) noexcept;
  [[nodiscard]] static RefineColumns columns(const Set& set) noexcept;

  std::array<Set, kMaxCameras> sets_{};
  int cameras_ = 0;
};

/// X_left ← Exp(φ) X_left + τ.
[[nodiscard]] Transform moved(const Transform& T_left_world, const Vec6& delta) noexcept;

/// Solves H δ = g for a positive definite H. False: not so, or not finite; *delta untouched.
[[nodiscard]] bool solve_normal(const Mat6& H, const Vec6& g, Vec6* delta) noexcept;

}  // namespace vergence::detail
