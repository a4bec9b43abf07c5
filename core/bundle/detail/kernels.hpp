#pragma once
#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// The arithmetic of one step, eight points at a time, compiled once per SIMD target and chosen at
/// run time. All are sums into the job's arrays; the caller clears them.

/// Residuals, weights, normal equations and eliminated points of batches [first, last): one pass
/// over their observations.
void linearise(KernelJob& job, std::size_t first, std::size_t last) noexcept;

/// A −= Y Yᵀ over batches [first, last), a whole group and the last that linearise() had in hand; A
/// is lower triangular, column-major, leading dimension ld.
void subtract_points(const KernelJob& job, std::size_t first, std::size_t last, double* A,
                     std::size_t ld) noexcept;

/// Points of batches [first, last) moved by δ = P⁻¹(e_P − Wᵀ δ_x) from `points` into `candidate`.
/// delta: the reduced system's solution.
void back_substitute(KernelJob& job, std::size_t first, std::size_t last,
                     const double* delta) noexcept;

/// Cost and residuals alone.
void evaluate(KernelJob& job, std::size_t first, std::size_t last) noexcept;

/// Result of the Cholesky factorisation.
struct PivotReport {
  int small =
      0;  // pivots not above `tolerance` times their diagonal: their parameter is left where it is
  double min_ratio = 1;     // least pivot over its diagonal
  double second_ratio = 1;  // the least but one
};

/// A = L Lᵀ in place for the first `columns` columns, all n rows (columns a multiple of kBlock, ld
/// ≥ n rounded up to kBatch).
PivotReport cholesky(double* A, std::size_t n, std::size_t columns, std::size_t ld,
                     double tolerance) noexcept;

/// b ← (L Lᵀ)⁻¹ b; b has room for ld.
void solve_factored(const double* L, std::size_t n, std::size_t ld, double* b) noexcept;

}  // namespace vergence::detail
