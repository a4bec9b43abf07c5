#pragma once
#include <array>
#include <cstddef>

namespace vergence::detail {

/// Loops over observations in SIMD lanes, one source for every instruction set (Highway, chosen at
/// run time).
///
/// Sums run in a fixed number of virtual lanes and are closed in a fixed order, without fused
/// multiply-add: bit-identical on every target. Columns are padded to whole blocks; what a padding
/// entry holds is said at each struct.
inline constexpr std::size_t kFloatBlock = 16;  // lanes of the widest float vector (AVX-512)
inline constexpr std::size_t kDoubleBlock = 8;  // and of double

[[nodiscard]] constexpr std::size_t padded(std::size_t n, std::size_t block) noexcept {
  return (n + block - 1) / block * block;
}

/// Points and pixels of one camera for scoring. Padding: any finite numbers, cap = 0.
struct ScoreColumns {
  const float *x, *y, *z;  // m, about a centre near them
  const float *u, *v;      // px, from the principal point
  const float* weight;     // 1/σ², px⁻²
  const float* cap;        // what an outlier costs, in squared sigmas
};

/// Rows of diag(fx, fy, 1) [R | t], row-major.
using ProjectionRows = std::array<float, 12>;

/// Σ over [first, last) of min(r² weight, cap); cap where the depth is under `min_depth`. first and
/// last are whole blocks.
[[nodiscard]] float projection_cost(const ScoreColumns& columns, std::size_t first,
                                    std::size_t last, const ProjectionRows& rows,
                                    float min_depth) noexcept;

/// Matches of two cameras in normalised coordinates for scoring. Padding: any finite numbers, cap =
/// 0.
struct MatchColumns {
  const float *x1, *y1, *x2, *y2;
  const float* weight;  // 1/σ², normalised units⁻²
  const float* cap;
};

/// Σ of min(d² weight, cap), d the Sampson distance under the essential matrix E (row-major). Whole
/// blocks.
[[nodiscard]] float sampson_cost(const MatchColumns& columns, std::size_t first, std::size_t last,
                                 const std::array<float, 9>& E) noexcept;

/// Points and pixels of one camera for refinement. Padding: finite, weight = 0.
struct RefineColumns {
  const double *x, *y, *z;  // world, m
  const double *u, *v;      // px, from the principal point
  const double* weight;     // 1/σ², px⁻²
};

/// A camera for refinement: q = R p + lever, X = q + t, pixel from the principal point (fx X/Z, fy
/// Y/Z).
struct RefineCamera {
  std::array<double, 9> R;  // row-major
  std::array<double, 3> lever, t;
  double fx, fy;
};

/// Sums of the weighted least squares of q moved as q ← Exp(φ) q + τ, δ = (φ, τ).
struct NormalSums {
  std::array<double, 21> H;  // upper triangle of Σ w JᵀJ, row by row
  std::array<double, 6> g;   // Σ w Jᵀ r, r = measured − projected
  double cost;               // Σ ρ(e): Huber, e² inside
};

/// Over [0, n), n whole blocks. e = |r|/σ · inverse_scale; Huber at `huber`; points under
/// `min_depth` have weight 0 and cost `behind_cost`, which padding has not.
[[nodiscard]] NormalSums normal_sums(const RefineColumns& columns, std::size_t n,
                                     const RefineCamera& camera, double inverse_scale, double huber,
                                     double min_depth, double behind_cost) noexcept;

/// |r|²/σ² of [0, n) into out, n whole blocks; `behind` where the depth is under min_depth.
void squared_errors(const RefineColumns& columns, std::size_t n, const RefineCamera& camera,
                    double min_depth, double behind, double* out) noexcept;

}  // namespace vergence::detail
