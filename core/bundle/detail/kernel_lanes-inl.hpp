// Shared parts of the kernels: one point per lane, residuals of a slot, the loss. Included once per
// SIMD target after <hwy/highway.h>; hence no `#pragma once`.
#if defined(VERGENCE_CORE_BUNDLE_DETAIL_KERNEL_LANES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef VERGENCE_CORE_BUNDLE_DETAIL_KERNEL_LANES_INL_HPP
#undef VERGENCE_CORE_BUNDLE_DETAIL_KERNEL_LANES_INL_HPP
#else
#define VERGENCE_CORE_BUNDLE_DETAIL_KERNEL_LANES_INL_HPP
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "core/bundle/detail/kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::detail {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kBatch>;
using V = hn::Vec<D>;

HWY_INLINE V load(const double* p) { return hn::Load(D(), p); }
HWY_INLINE V set(double v) { return hn::Set(D(), v); }
HWY_INLINE void store(V v, double* p) { hn::Store(v, D(), p); }
HWY_INLINE void add_to(V v, double* p) { store(hn::Add(load(p), v), p); }
HWY_INLINE double total(V v) { return hn::GetLane(hn::SumOfLanes(D(), v)); }

/// R X + t, row by row.
HWY_INLINE void transform(const double* R, const double* t, const V X[3], V out[3]) {
  for (int r = 0; r < 3; ++r)
    out[r] = hn::MulAdd(
        set(R[3 * r]), X[0],
        hn::MulAdd(set(R[3 * r + 1]), X[1], hn::MulAdd(set(R[3 * r + 2]), X[2], set(t[r]))));
}

/// Results of a slot for its points. It needs aggregate initialisation: a default constructor would
/// be compiled for the baseline instruction set, where vector constructors cannot be inlined.
struct Residual {
  /// Observed minus predicted, in px.
  V x, y;
  /// 1/σ²; 0 without an observation.
  V weight;
  /// Depth along the camera's axis; kFar without an observation.
  V depth;
  V iz, xn, yn;
};

/// Pinhole without distortion. Lanes without an observation have arbitrary finite results with
/// weight 0.
HWY_INLINE Residual project(const KernelCamera& camera, const Slot& slot, std::size_t lane,
                            const V Xi[3], V* behind) {
  const D d;
  V Xc[3] = {Xi[0], Xi[1], Xi[2]};
  if (!camera.identity) transform(camera.R, camera.t, Xi, Xc);
  const V inverse_sigma = load(slot.inverse_sigma + lane);
  const V one = set(1.0);
  const auto in_front = hn::Ge(Xc[2], set(kMinDepth));
  const auto seen = hn::Gt(inverse_sigma, hn::Zero(d));
  *behind = hn::Add(*behind, hn::IfThenElseZero(hn::AndNot(in_front, seen), one));
  const V iz = hn::Div(one, hn::IfThenElse(in_front, Xc[2], one));
  const V x = hn::IfThenElseZero(in_front, Xc[0]), y = hn::IfThenElseZero(in_front, Xc[1]);
  const V xn = hn::Mul(x, iz), yn = hn::Mul(y, iz);
  return {hn::Sub(load(slot.x + lane), hn::MulAdd(set(camera.fx), xn, set(camera.cx))),
          hn::Sub(load(slot.y + lane), hn::MulAdd(set(camera.fy), yn, set(camera.cy))),
          hn::Mul(inverse_sigma, inverse_sigma),
          hn::IfThenElse(seen, Xc[2], set(kFar)),
          iz,
          xn,
          yn};
}

/// Computes the residuals from the camera model's results.
HWY_INLINE Residual from_jets(const double* jet, const Slot& slot, std::size_t lane) {
  const V inverse_sigma = load(slot.inverse_sigma + lane);
  const V zero = hn::Zero(D());
  return {load(jet + 6 * kBatch + lane),
          load(jet + 7 * kBatch + lane),
          hn::Mul(inverse_sigma, inverse_sigma),
          load(jet + kJetDepth * kBatch + lane),
          zero,
          zero,
          zero};
}

/// Returns twice the loss of s = |ε|²/σ², with its derivative in *weight.
HWY_INLINE V loss(BundleLoss kind, double threshold2, V s, V* weight) {
  const D d;
  const V one = set(1.0);
  if (kind == BundleLoss::none) {
    *weight = one;
    return s;
  }
  const V c2 = set(threshold2);
  /// 2 c √s − c² beyond c.
  if (kind == BundleLoss::huber) {
    const auto linear = hn::Gt(s, c2);
    const V root = hn::Sqrt(hn::Mul(c2, hn::IfThenElse(linear, s, c2)));
    *weight = hn::IfThenElse(linear, hn::Div(c2, root), one);
    return hn::IfThenElse(linear, hn::Sub(hn::Add(root, root), c2), s);
  }
  const V u = hn::Add(one, hn::Mul(s, set(1.0 / threshold2)));
  *weight = hn::Div(one, u);
  return hn::Mul(c2, hn::Log(d, u));
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::detail
HWY_AFTER_NAMESPACE();
#endif
