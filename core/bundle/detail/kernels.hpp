#pragma once
#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// Arithmetic of one step for eight points at a time, compiled per SIMD target and selected at run
/// time. Results are added to the job's arrays, which the caller clears.

/// Computes residuals, weights, normal equations and eliminated points of batches [first, last) in
/// one pass over their observations.
void linearise(KernelJob& job, std::size_t first, std::size_t last) noexcept;

/// Subtracts Y Yᵀ from A over batches [first, last), the whole group of the last linearise(). A is
/// lower triangular, column-major, with leading dimension ld.
void subtract_points(const KernelJob& job, std::size_t first, std::size_t last, double* A,
                     std::size_t ld) noexcept;

/// Moves the points of batches [first, last) by δ = P⁻¹(e_P − Wᵀ δ_x) from `points` to `candidate`.
/// `delta`: solution of the reduced system.
void back_substitute(KernelJob& job, std::size_t first, std::size_t last,
                     const double* delta) noexcept;

/// Computes cost and residuals only.
void evaluate(KernelJob& job, std::size_t first, std::size_t last) noexcept;

struct PivotReport {
  /// Number of pivots not above `tolerance` times their diagonal; those parameters are not moved.
  int small = 0;
  /// Smallest ratio of a pivot to its diagonal.
  double min_ratio = 1;
  /// Second smallest ratio.
  double second_ratio = 1;
};

/// Factorises A = L Lᵀ in place for the first `columns` columns and all n rows (columns a multiple
/// of kBlock, ld ≥ n rounded up to kBatch).
PivotReport cholesky(double* A, std::size_t n, std::size_t columns, std::size_t ld,
                     double tolerance) noexcept;

/// Computes b ← (L Lᵀ)⁻¹ b; b has room for ld.
void solve_factored(const double* L, std::size_t n, std::size_t ld, double* b) noexcept;

}  // namespace vergence::detail
