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

/// Distorts the point (x, y) of squared radius r2; J: ∂distorted/∂(x, y) as xx, xy, yy. See Camera
/// for the models.
HWY_INLINE void distort(const KernelCamera& camera, V x, V y, V r2, V distorted[2], V J[3]) {
  const double* k = camera.distortion;
  const V two = set(2.0);
  if (camera.equidistant) {
    // The limit of θ_d/r in the middle is 1, which this radius gives to the last digit.
    const V r = hn::Sqrt(hn::Max(r2, set(1e-18)));
    const V theta = hn::Atan(hn::DFromV<V>(), r), t2 = hn::Mul(theta, theta);
    const auto series = [&](const double c[4]) HWY_ATTR {
      V sum = set(c[3]);
      for (int i = 2; i >= 0; --i) sum = hn::MulAdd(t2, sum, set(c[i]));
      return hn::MulAdd(t2, sum, set(1.0));
    };
    const double slopes[4] = {3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]};
    const V scale = hn::Div(hn::Mul(theta, series(k)), r);
    const V slope = hn::Div(series(slopes), hn::Add(set(1.0), r2));
    const V along = hn::Div(hn::Sub(slope, scale), hn::Mul(r, r));
    distorted[0] = hn::Mul(scale, x), distorted[1] = hn::Mul(scale, y);
    J[0] = hn::MulAdd(along, hn::Mul(x, x), scale);
    J[1] = hn::Mul(along, hn::Mul(x, y));
    J[2] = hn::MulAdd(along, hn::Mul(y, y), scale);
    return;
  }
  const V factor =
      hn::MulAdd(r2, hn::MulAdd(r2, hn::MulAdd(r2, set(k[4]), set(k[1])), set(k[0])), set(1.0));
  const V slope = hn::MulAdd(r2, hn::MulAdd(r2, set(3 * k[4]), set(2 * k[1])), set(k[0]));
  const V p1 = set(k[2]), p2 = set(k[3]), xy2 = hn::Mul(two, hn::Mul(x, y)),
          xx2 = hn::Mul(two, hn::Mul(x, x)), yy2 = hn::Mul(two, hn::Mul(y, y));
  distorted[0] = hn::MulAdd(x, factor, hn::MulAdd(p1, xy2, hn::Mul(p2, hn::Add(r2, xx2))));
  distorted[1] = hn::MulAdd(y, factor, hn::MulAdd(p2, xy2, hn::Mul(p1, hn::Add(r2, yy2))));
  const V px = hn::Mul(p2, x), py = hn::Mul(p1, y);
  J[0] = hn::MulAdd(xx2, slope, hn::MulAdd(two, hn::MulAdd(set(3.0), px, py), factor));
  J[1] = hn::MulAdd(xy2, slope, hn::Mul(two, hn::MulAdd(p1, x, hn::Mul(p2, y))));
  J[2] = hn::MulAdd(yy2, slope, hn::MulAdd(two, hn::MulAdd(set(3.0), py, px), factor));
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
  /// 1/Z and (X, Y)/Z in the camera.
  V iz, xn, yn;
  /// The distorted (xn, yn).
  V distorted[2];
  /// Its derivatives by (xn, yn): xx, xy, yy.
  V J[3];
};

/// Projects the points of a slot. Lanes without an observation have arbitrary finite results with
/// weight 0. kLenses: with distortion; *behind counts points outside its range as well.
template <bool kLenses>
HWY_INLINE Residual project(const KernelCamera& camera, const Slot& slot, std::size_t lane,
                            const V Xi[3], V* behind) {
  const D d;
  V Xc[3] = {Xi[0], Xi[1], Xi[2]};
  if (!camera.identity) transform(camera.R, camera.t, Xi, Xc);
  const V inverse_sigma = load(slot.inverse_sigma + lane);
  const V zero = hn::Zero(d), one = set(1.0);
  const auto in_front = hn::Ge(Xc[2], set(kMinDepth));
  const auto seen = hn::Gt(inverse_sigma, zero);
  const V iz = hn::Div(one, hn::IfThenElse(in_front, Xc[2], one));
  V xn = hn::IfThenElseZero(in_front, hn::Mul(Xc[0], iz)),
    yn = hn::IfThenElseZero(in_front, hn::Mul(Xc[1], iz));
  auto usable = in_front;
  V at[2] = {xn, yn}, J[3] = {one, zero, one};
  if (kLenses && camera.distorted) {
    const V r2 = hn::MulAdd(xn, xn, hn::Mul(yn, yn));
    const auto inside = hn::Le(r2, set(camera.max_radius2));
    usable = hn::And(usable, inside);
    xn = hn::IfThenElseZero(inside, xn), yn = hn::IfThenElseZero(inside, yn);
    distort(camera, xn, yn, hn::IfThenElseZero(inside, r2), at, J);
  }
  *behind = hn::Add(*behind, hn::IfThenElseZero(hn::AndNot(usable, seen), one));
  return {hn::Sub(load(slot.x + lane), hn::MulAdd(set(camera.fx), at[0], set(camera.cx))),
          hn::Sub(load(slot.y + lane), hn::MulAdd(set(camera.fy), at[1], set(camera.cy))),
          hn::Mul(inverse_sigma, inverse_sigma),
          hn::IfThenElse(seen, Xc[2], set(kFar)),
          iz,
          xn,
          yn,
          {at[0], at[1]},
          {J[0], J[1], J[2]}};
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
