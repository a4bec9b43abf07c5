// Dense part of a step: Y Yᵀ and Cholesky. Compiled once per SIMD target (see kernels.hpp).
#include <algorithm>
#include <cmath>

#include "core/bundle/detail/kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/bundle/detail/dense.cpp"
#include "core/bundle/detail/simd.hpp"
// Highway requires this order.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace vergence::detail {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kBatch>;
using V = hn::Vec<D>;

// Rows of a tile's accumulators: six by three columns with 32 registers, three by three with 16.
#if HWY_TARGET <= HWY_AVX3 || HWY_ARCH_ARM_A64
constexpr int kTileRows = 6;
#else
constexpr int kTileRows = 3;
#endif

/// One 6×6 block of Y at the same position in each batch of a group.
struct YBlock {
  const double* first;
  // Number of doubles between batches.
  std::size_t stride;
  // Row in A.
  std::int32_t row;
};

#if HWY_TARGET == HWY_SCALAR

/// Computes at[0] −= x, at[1] −= y.
HWY_INLINE void subtract_sums(V x, V y, double* at) {
  at[0] -= hn::GetLane(x);
  at[1] -= hn::GetLane(y);
}

#else

/// Sums a vector of pairs (x, y, x, y, …) to one pair.
template <class DPairs>
HWY_INLINE hn::Vec<hn::FixedTag<double, 2> > fold_pairs([[maybe_unused]] DPairs d,
                                                        hn::Vec<DPairs> v) {
  if constexpr (sizeof(hn::Vec<DPairs>) > 2 * sizeof(double)) {
    const hn::Half<DPairs> half;
    return fold_pairs(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
  } else {
    return v;
  }
}

/// Computes at[0] −= Σ x, at[1] −= Σ y.
HWY_INLINE void subtract_sums(V x, V y, double* at) {
  const D d;
  const hn::FixedTag<double, 2> pair;
  const V both = hn::Add(hn::InterleaveLower(d, x, y), hn::InterleaveUpper(d, x, y));
  hn::StoreU(hn::Sub(hn::LoadU(pair, at), fold_pairs(d, both)), pair, at);
}

#endif

/// Computes A[a, b] −= Σ Y_a Y_bᵀ over `count` batches, for rows row0 … row0 + kTileRows and
/// columns col0 … col0 + 3 of the block.
HWY_INLINE void tile(const YBlock& a, const YBlock& b, std::size_t count, int row0, int col0,
                     double* HWY_RESTRICT A, std::size_t ld) {
  const D d;
  V sum[kTileRows * 3];
  for (V& s : sum) s = hn::Zero(d);
  const double* HWY_RESTRICT pa = a.first + static_cast<std::size_t>(row0) * 3 * kBatch;
  const double* HWY_RESTRICT pb = b.first + static_cast<std::size_t>(col0) * 3 * kBatch;
  for (std::size_t i = 0; i < count; ++i, pa += a.stride, pb += b.stride) {
    for (std::size_t k = 0; k < 3 * kBatch; k += hn::Lanes(d)) {
      const V b0 = hn::Load(d, pb + k), b1 = hn::Load(d, pb + 3 * kBatch + k),
              b2 = hn::Load(d, pb + 6 * kBatch + k);
#pragma GCC unroll 6
      for (int r = 0; r < kTileRows; ++r) {
        const V va = hn::Load(d, pa + r * 3 * kBatch + static_cast<int>(k));
        sum[3 * r] = hn::MulAdd(va, b0, sum[3 * r]);
        sum[3 * r + 1] = hn::MulAdd(va, b1, sum[3 * r + 1]);
        sum[3 * r + 2] = hn::MulAdd(va, b2, sum[3 * r + 2]);
      }
    }
  }
  double* at =
      A + static_cast<std::size_t>(b.row + col0) * ld + static_cast<std::size_t>(a.row + row0);
#pragma GCC unroll 3
  for (int c = 0; c < 3; ++c, at += ld) {
#pragma GCC unroll 6
    for (int r = 0; r + 1 < kTileRows; r += 2)
      subtract_sums(sum[3 * r + c], sum[3 * (r + 1) + c], at + r);
    if constexpr (kTileRows % 2 != 0)
      at[kTileRows - 1] -= hn::GetLane(hn::SumOfLanes(d, sum[3 * (kTileRows - 1) + c]));
  }
}

void subtract_points_one(const KernelJob& job, std::size_t first, std::size_t last, double* A,
                         std::size_t ld) {
  const Batch& batch = job.batches[first];
  const std::size_t block_count = batch.block_end - batch.block_begin;
  const auto block_at = [&](std::size_t i) {
    if (i < block_count)
      return YBlock{job.y_group + i * kYSize, block_count * kYSize,
                    job.poses[job.blocks[batch.block_begin + i].pose].block * kBlock};
    const std::size_t s = i - block_count, shared = static_cast<std::size_t>(job.shared.blocks);
    return YBlock{job.y_shared + (first * shared + s) * kYSize, shared * kYSize,
                  (job.free_poses + static_cast<std::int32_t>(s)) * kBlock};
  };
  const std::size_t all = block_count + static_cast<std::size_t>(job.shared.blocks);
  for (std::size_t i = 0; i < all; ++i) {
    const YBlock a = block_at(i);
    if (a.row < 0) continue;
    for (std::size_t j = 0; j <= i; ++j) {
      const YBlock b = block_at(j);
      if (b.row < 0) continue;
      for (int row0 = 0; row0 < kBlock; row0 += kTileRows)
        for (int col0 = 0; col0 < kBlock; col0 += 3)
          if (i != j || row0 + kTileRows > col0) tile(a, b, last - first, row0, col0, A, ld);
    }
  }
}

/// Subtracts the contribution of earlier columns from columns p … p + 5, for rows from the vector
/// that contains p.
template <int kVectors>
HWY_INLINE void update_panel(double* HWY_RESTRICT A, std::size_t ld, std::size_t p,
                             std::size_t row) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  V sum[kBlock * kVectors];
  for (V& s : sum) s = hn::Zero(d);
  for (std::size_t k = 0; k < p; ++k) {
    const double* column = A + k * ld;
    V l[kVectors];
    for (int v = 0; v < kVectors; ++v)
      l[v] = hn::Load(d, column + row + static_cast<std::size_t>(v) * N);
#pragma GCC unroll 6
    for (int c = 0; c < kBlock; ++c) {
      const V f = hn::Set(d, column[p + static_cast<std::size_t>(c)]);
      for (int v = 0; v < kVectors; ++v)
        sum[c * kVectors + v] = hn::MulAdd(l[v], f, sum[c * kVectors + v]);
    }
  }
  for (int c = 0; c < kBlock; ++c)
    for (int v = 0; v < kVectors; ++v) {
      double* at =
          A + (p + static_cast<std::size_t>(c)) * ld + row + static_cast<std::size_t>(v) * N;
      hn::Store(hn::Sub(hn::Load(d, at), sum[c * kVectors + v]), d, at);
    }
}

PivotReport cholesky_one(double* HWY_RESTRICT A, std::size_t n, std::size_t columns, std::size_t ld,
                         double tolerance) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  const std::size_t rows = (n + N - 1) / N * N;
  // Pivot of a parameter that is not moved.
  constexpr double kFrozen = 1e100;
  PivotReport report;
  for (std::size_t p = 0; p < columns; p += kBlock) {
    double diagonal[kBlock];
    for (std::size_t c = 0; c < kBlock; ++c) diagonal[c] = A[(p + c) * ld + p + c];
    std::size_t row = p / N * N;
    for (; row + 2 * N <= rows; row += 2 * N) update_panel<2>(A, ld, p, row);
    if (row < rows) update_panel<1>(A, ld, p, row);

    double L[kBlock][kBlock] = {}, inverse[kBlock];
    for (std::size_t c = 0; c < kBlock; ++c) {
      double pivot = A[(p + c) * ld + p + c];
      for (std::size_t k = 0; k < c; ++k) pivot -= L[c][k] * L[c][k];
      const double ratio = diagonal[c] > 0 ? pivot / diagonal[c] : 0;
      if (ratio < report.min_ratio) {
        report.second_ratio = report.min_ratio;
        report.min_ratio = ratio;
      } else {
        report.second_ratio = std::min(report.second_ratio, ratio);
      }
      if (!(ratio > tolerance)) {
        ++report.small;
        L[c][c] = kFrozen;
        inverse[c] = 0;
        continue;
      }
      L[c][c] = std::sqrt(pivot);
      inverse[c] = 1.0 / L[c][c];
      for (std::size_t r = c + 1; r < kBlock; ++r) {
        double v = A[(p + c) * ld + p + r];
        for (std::size_t k = 0; k < c; ++k) v -= L[r][k] * L[c][k];
        L[r][c] = v * inverse[c];
      }
    }
    // This loop also processes the rows of the diagonal block, which are corrected afterwards, to
    // use whole vectors without masks.
    for (row = p / N * N; row < rows; row += N) {
      V x[kBlock];
#pragma GCC unroll 6
      for (std::size_t c = 0; c < kBlock; ++c) {
        V v = hn::Load(d, A + (p + c) * ld + row);
#pragma GCC unroll 6
        for (std::size_t k = 0; k < c; ++k) v = hn::NegMulAdd(x[k], hn::Set(d, L[c][k]), v);
        x[c] = hn::Mul(v, hn::Set(d, inverse[c]));
        hn::Store(x[c], d, A + (p + c) * ld + row);
      }
    }
    for (std::size_t c = 0; c < kBlock; ++c)
      for (std::size_t r = c; r < kBlock; ++r) A[(p + c) * ld + p + r] = L[r][c];
  }
  return report;
}

void solve_factored_one(const double* HWY_RESTRICT L, std::size_t n, std::size_t ld,
                        double* HWY_RESTRICT b) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  const std::size_t rows = (n + N - 1) / N * N;
  for (std::size_t i = n; i < rows; ++i) b[i] = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double* column = L + k * ld;
    const double value = b[k] / column[k];
    const V f = hn::Set(d, value);
    // The vector of row k also contains solved rows, which are saved and restored.
    const std::size_t start = k / N * N;
    double head[kBatch];
    for (std::size_t i = start; i < k; ++i) head[i - start] = b[i];
    for (std::size_t i = start; i < rows; i += N)
      hn::Store(hn::NegMulAdd(hn::Load(d, column + i), f, hn::Load(d, b + i)), d, b + i);
    for (std::size_t i = start; i < k; ++i) b[i] = head[i - start];
    b[k] = value;
  }
  for (std::size_t i = n; i < rows; ++i) b[i] = 0;
  for (std::size_t k = n; k-- > 0;) {
    const double* column = L + k * ld;
    const std::size_t start = (k / N + 1) * N;
    V sum = hn::Zero(d);
    for (std::size_t i = start; i < rows; i += N)
      sum = hn::MulAdd(hn::Load(d, column + i), hn::Load(d, b + i), sum);
    double v = b[k] - hn::GetLane(hn::SumOfLanes(d, sum));
    for (std::size_t i = k + 1; i < std::min(start, n); ++i) v -= column[i] * b[i];
    b[k] = v / column[k];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::detail {

HWY_EXPORT(subtract_points_one);
HWY_EXPORT(cholesky_one);
HWY_EXPORT(solve_factored_one);

void subtract_points(const KernelJob& job, std::size_t first, std::size_t last, double* A,
                     std::size_t ld) noexcept {
  HWY_DYNAMIC_DISPATCH(subtract_points_one)(job, first, last, A, ld);
}
PivotReport cholesky(double* A, std::size_t n, std::size_t columns, std::size_t ld,
                     double tolerance) noexcept {
  return HWY_DYNAMIC_DISPATCH(cholesky_one)(A, n, columns, ld, tolerance);
}
void solve_factored(const double* L, std::size_t n, std::size_t ld, double* b) noexcept {
  HWY_DYNAMIC_DISPATCH(solve_factored_one)(L, n, ld, b);
}

}  // namespace vergence::detail
#endif
