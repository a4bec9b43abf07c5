#pragma once
#include <array>
#include <cstddef>

namespace vergence::detail {

/// Loops over observations in SIMD lanes, from one source for every instruction set (Highway,
/// selected at run time).
///
/// Sums run in a fixed number of virtual lanes and are reduced in a fixed order, without fused
/// multiply-add: bit-identical on every target. Columns are padded to whole blocks, the lanes of
/// the widest vectors (AVX-512); each struct states its padding.
inline constexpr std::size_t kFloatBlock = 16;
inline constexpr std::size_t kDoubleBlock = 8;

[[nodiscard]] constexpr std::size_t padded(std::size_t n, std::size_t block) noexcept {
  return (n + block - 1) / block * block;
}

/// Points and pixels of one camera for scoring. Padding: any finite numbers, cap = 0.
struct ScoreColumns {
  /// Points in metres, about a centre near them.
  const float *x, *y, *z;
  /// Pixels from the principal point.
  const float *u, *v;
  /// 1/σ², in px⁻².
  const float* weight;
  /// Cost of an outlier, in squared sigmas.
  const float* cap;
};

/// Rows of diag(fx, fy, 1) [R | t], row-major.
using ProjectionRows = std::array<float, 12>;

/// Sum over [first, last) of min(r² weight, cap); cap if the depth is below `min_depth`. `first`
/// and `last` are multiples of the block.
[[nodiscard]] float projection_cost(const ScoreColumns& columns, std::size_t first,
                                    std::size_t last, const ProjectionRows& rows,
                                    float min_depth) noexcept;

/// Matches of two cameras in normalised coordinates for scoring. Padding: any finite numbers, cap =
/// 0.
struct MatchColumns {
  const float *x1, *y1, *x2, *y2;
  /// 1/σ², in normalised units⁻².
  const float* weight;
  const float* cap;
};

/// Sum of min(d² weight, cap) with d the Sampson distance under the essential matrix E (row-major),
/// over whole blocks.
[[nodiscard]] float sampson_cost(const MatchColumns& columns, std::size_t first, std::size_t last,
                                 const std::array<float, 9>& E) noexcept;

/// Points and pixels of one camera for refinement. Padding: finite, weight = 0.
struct RefineColumns {
  /// Points in the world, in metres.
  const double *x, *y, *z;
  /// Pixels from the principal point.
  const double *u, *v;
  /// 1/σ², in px⁻².
  const double* weight;
};

/// A camera for refinement: q = R p + lever, X = q + t, pixel from the principal point (fx X/Z, fy
/// Y/Z). R is row-major.
struct RefineCamera {
  std::array<double, 9> R;
  std::array<double, 3> lever, t;
  double fx, fy;
};

/// Sums of the weighted least squares for q ← Exp(φ) q + τ, δ = (φ, τ).
struct NormalSums {
  /// Upper triangle of Σ w JᵀJ, row by row.
  std::array<double, 21> H;
  /// Σ w Jᵀ r with r = measured − projected.
  std::array<double, 6> g;
  /// Σ ρ(e) with Huber's loss, which is e² for inliers.
  double cost;
};

/// Computes the sums over [0, n), n a multiple of the block, with e = |r|/σ · inverse_scale and
/// Huber's threshold `huber`. Points below `min_depth` have weight 0 and, unless they are padding,
/// cost `behind_cost`.
[[nodiscard]] NormalSums normal_sums(const RefineColumns& columns, std::size_t n,
                                     const RefineCamera& camera, double inverse_scale, double huber,
                                     double min_depth, double behind_cost) noexcept;

/// Writes |r|²/σ² of [0, n) to `out`, n a multiple of the block; `behind` if the depth is below
/// min_depth.
void squared_errors(const RefineColumns& columns, std::size_t n, const RefineCamera& camera,
                    double min_depth, double behind, double* out) noexcept;

}  // namespace vergence::detail
