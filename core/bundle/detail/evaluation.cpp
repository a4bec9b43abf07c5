// Cost at a state, and the step of the points given that of poses and cameras. Compiled once per
// SIMD target.
#include <bit>

#include "core/bundle/detail/kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/bundle/detail/evaluation.cpp"
#include "core/bundle/detail/simd.hpp"
// Highway requires this order.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "core/bundle/detail/kernel_lanes-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace vergence::detail {
namespace HWY_NAMESPACE {

// Maximum step of a point as a share of its minimum depth.
constexpr double kDepthShare = 0.8;

template <bool kLenses>
HWY_INLINE void evaluate_lanes(KernelJob& job, std::size_t index, std::size_t lane) {
  const D d;
  const Batch& batch = job.batches[index];
  V X[3];
  for (int r = 0; r < 3; ++r)
    X[r] = load(job.points + (index * 3 + static_cast<std::size_t>(r)) * kBatch + lane);
  const V zero = hn::Zero(d);
  V cost = zero, squared = zero, weighted = zero, behind = zero;
  for (std::uint32_t at = batch.block_begin; at < batch.block_end; ++at) {
    const PoseBlock& block = job.blocks[at];
    V Xi[3];
    transform(job.poses[block.pose].R, job.poses[block.pose].t, X, Xi);
    std::size_t slot = block.slot;
    for (unsigned mask = block.cameras; mask != 0; mask &= mask - 1, ++slot) {
      const Residual r =
          project<kLenses>(job.cameras[std::countr_zero(mask)], job.slots[slot], lane, Xi, &behind);
      const V r2 = hn::MulAdd(r.x, r.x, hn::Mul(r.y, r.y));
      const V s = hn::Mul(r.weight, r2);
      V factor;
      cost = hn::Add(cost, loss(job.loss, job.threshold2, s, &factor));
      weighted = hn::MulAdd(s, factor, weighted);
      squared = hn::Add(squared, hn::IfThenElseZero(hn::Gt(r.weight, zero), r2));
      if (job.squared != nullptr) {
        const hn::Rebind<float, D> df;
        hn::Store(hn::DemoteTo(df, s), df, job.squared + slot * kBatch + lane);
      }
    }
  }
  job.cost += 0.5 * total(cost);
  job.weighted += total(weighted);
  job.squared_px += total(squared);
  job.behind = job.behind || total(behind) > 0;
}

HWY_INLINE void back_substitute_lanes(KernelJob& job, std::size_t index, std::size_t lane,
                                      const double* delta) {
  const Batch& batch = job.batches[index];
  const double* factor = job.factors + index * kFactorRows * kBatch + lane;
  V X[3], v[3];
  for (std::size_t r = 0; r < 3; ++r) X[r] = load(job.points + (index * 3 + r) * kBatch + lane);
  for (int r = 0; r < 3; ++r) v[r] = load(factor + (6 + r) * kBatch);
  for (std::uint32_t at = batch.block_begin; at < batch.block_end; ++at) {
    const KernelPose& pose = job.poses[job.blocks[at].pose];
    if (pose.block < 0) continue;
    // In the order τ, φ.
    const double* step = delta + pose.block * kBlock;
    V Xi[3];
    transform(pose.R, pose.t, X, Xi);
    const double* y = job.y + static_cast<std::size_t>(at) * kYTop + lane;
    // The step moves X_i by τ + φ × X_i.
#pragma GCC unroll 3
    for (int r = 0; r < 3; ++r) {
      const int a = (r + 1) % 3, b = (r + 2) % 3;
      const V moved =
          hn::MulAdd(set(step[3 + a]), Xi[b], hn::NegMulAdd(set(step[3 + b]), Xi[a], set(step[r])));
#pragma GCC unroll 3
      for (int c = 0; c < 3; ++c) v[c] = hn::NegMulAdd(load(y + (3 * r + c) * kBatch), moved, v[c]);
    }
  }
  const double* rows =
      job.y_shared + index * static_cast<std::size_t>(job.shared.blocks) * kYSize + lane;
  const double* shared_step = delta + job.free_poses * kBlock;
  for (int i = 0; i < job.shared.size; ++i)
    for (int c = 0; c < 3; ++c)
      v[c] = hn::NegMulAdd(load(rows + (3 * i + c) * kBatch), set(shared_step[i]), v[c]);
  const V m00 = load(factor), m10 = load(factor + kBatch), m11 = load(factor + 2 * kBatch),
          m20 = load(factor + 3 * kBatch), m21 = load(factor + 4 * kBatch),
          m22 = load(factor + 5 * kBatch);
  V step[3] = {hn::MulAdd(m00, v[0], hn::MulAdd(m10, v[1], hn::Mul(m20, v[2]))),
               hn::MulAdd(m11, v[1], hn::Mul(m21, v[2])), hn::Mul(m22, v[2])};
  const V length2 =
      hn::MulAdd(step[0], step[0], hn::MulAdd(step[1], step[1], hn::Mul(step[2], step[2])));
  const V limit = hn::Mul(set(kDepthShare), load(factor + 9 * kBatch));
  const V limit2 = hn::Mul(limit, limit);
  const auto too_far = hn::Gt(length2, limit2);
  const V scale = hn::IfThenElse(
      too_far, hn::Sqrt(hn::Div(limit2, hn::IfThenElse(too_far, length2, set(1.0)))), set(1.0));
  for (std::size_t r = 0; r < 3; ++r)
    store(hn::MulAdd(scale, step[r], X[r]), job.candidate + (index * 3 + r) * kBatch + lane);
  job.update += total(length2);
  job.norm += total(hn::MulAdd(X[0], X[0], hn::MulAdd(X[1], X[1], hn::Mul(X[2], X[2]))));
}

void evaluate_one(KernelJob& job, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i)
    for (std::size_t lane = 0; lane < kBatch; lane += hn::Lanes(D()))
      job.lenses ? evaluate_lanes<true>(job, i, lane) : evaluate_lanes<false>(job, i, lane);
}

void back_substitute_one(KernelJob& job, std::size_t first, std::size_t last, const double* delta) {
  for (std::size_t i = first; i < last; ++i)
    for (std::size_t lane = 0; lane < kBatch; lane += hn::Lanes(D()))
      back_substitute_lanes(job, i, lane, delta);
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::detail {

HWY_EXPORT(evaluate_one);
HWY_EXPORT(back_substitute_one);

void evaluate(KernelJob& job, std::size_t first, std::size_t last) noexcept {
  HWY_DYNAMIC_DISPATCH(evaluate_one)(job, first, last);
}
void back_substitute(KernelJob& job, std::size_t first, std::size_t last,
                     const double* delta) noexcept {
  HWY_DYNAMIC_DISPATCH(back_substitute_one)(job, first, last, delta);
}

}  // namespace vergence::detail
#endif
