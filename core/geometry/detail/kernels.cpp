// Compiled once per instruction set: foreach_target.h includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/geometry/detail/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/geometry/detail/kernels.hpp"
#include "core/math/pairwise_sum.hpp"

HWY_BEFORE_NAMESPACE();
namespace vergence::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kFloatBlock>;
using Doubles = hn::CappedTag<double, kDoubleBlock>;

template <class D, class V = hn::Vec<D>>
HWY_INLINE V dot3(V a, V b, V c, V x, V y, V z) {
  return hn::Add(hn::Add(hn::Mul(a, x), hn::Mul(b, y)), hn::Mul(c, z));
}

float ProjectionCost(const ScoreColumns& c, std::size_t first, std::size_t last,
                     const ProjectionRows& m, float min_depth) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d);
  const auto near = hn::Set(d, min_depth);
  const auto one = hn::Set(d, 1.0F);
  const auto m0 = hn::Set(d, m[0]), m1 = hn::Set(d, m[1]), m2 = hn::Set(d, m[2]),
             m3 = hn::Set(d, m[3]);
  const auto m4 = hn::Set(d, m[4]), m5 = hn::Set(d, m[5]), m6 = hn::Set(d, m[6]),
             m7 = hn::Set(d, m[7]);
  const auto m8 = hn::Set(d, m[8]), m9 = hn::Set(d, m[9]), m10 = hn::Set(d, m[10]),
             m11 = hn::Set(d, m[11]);
  HWY_ALIGN float sums[kFloatBlock];
  for (std::size_t lane = 0; lane < kFloatBlock; lane += lanes) {
    auto sum = hn::Zero(d);
    for (std::size_t i = first + lane; i < last; i += kFloatBlock) {
      const auto x = hn::LoadU(d, c.x + i), y = hn::LoadU(d, c.y + i), z = hn::LoadU(d, c.z + i);
      const auto X = hn::Add(dot3<Floats>(m0, m1, m2, x, y, z), m3);
      const auto Y = hn::Add(dot3<Floats>(m4, m5, m6, x, y, z), m7);
      const auto Z = hn::Add(dot3<Floats>(m8, m9, m10, x, y, z), m11);
      const auto iz = hn::Div(one, Z);
      const auto ru = hn::Sub(hn::Mul(X, iz), hn::LoadU(d, c.u + i));
      const auto rv = hn::Sub(hn::Mul(Y, iz), hn::LoadU(d, c.v + i));
      const auto e2 =
          hn::Mul(hn::Add(hn::Mul(ru, ru), hn::Mul(rv, rv)), hn::LoadU(d, c.weight + i));
      const auto cap = hn::LoadU(d, c.cap + i);
      const auto inside = hn::And(hn::Gt(Z, near), hn::Lt(e2, cap));
      sum = hn::Add(sum, hn::IfThenElse(inside, e2, cap));
    }
    hn::StoreU(sum, d, sums + lane);
  }
  return pairwise_sum<kFloatBlock>(sums);
}

float SampsonCost(const MatchColumns& c, std::size_t first, std::size_t last,
                  const std::array<float, 9>& E) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d);
  const auto e0 = hn::Set(d, E[0]), e1 = hn::Set(d, E[1]), e2 = hn::Set(d, E[2]);
  const auto e3 = hn::Set(d, E[3]), e4 = hn::Set(d, E[4]), e5 = hn::Set(d, E[5]);
  const auto e6 = hn::Set(d, E[6]), e7 = hn::Set(d, E[7]), e8 = hn::Set(d, E[8]);
  HWY_ALIGN float sums[kFloatBlock];
  for (std::size_t lane = 0; lane < kFloatBlock; lane += lanes) {
    auto sum = hn::Zero(d);
    for (std::size_t i = first + lane; i < last; i += kFloatBlock) {
      const auto x1 = hn::LoadU(d, c.x1 + i), y1 = hn::LoadU(d, c.y1 + i);
      const auto x2 = hn::LoadU(d, c.x2 + i), y2 = hn::LoadU(d, c.y2 + i);
      const auto l0 = hn::Add(hn::Add(hn::Mul(e0, x1), hn::Mul(e1, y1)), e2);
      const auto l1 = hn::Add(hn::Add(hn::Mul(e3, x1), hn::Mul(e4, y1)), e5);
      const auto l2 = hn::Add(hn::Add(hn::Mul(e6, x1), hn::Mul(e7, y1)), e8);
      const auto k0 = hn::Add(hn::Add(hn::Mul(e0, x2), hn::Mul(e3, y2)), e6);
      const auto k1 = hn::Add(hn::Add(hn::Mul(e1, x2), hn::Mul(e4, y2)), e7);
      const auto r = hn::Add(hn::Add(hn::Mul(x2, l0), hn::Mul(y2, l1)), l2);
      const auto s = hn::Add(hn::Add(hn::Mul(l0, l0), hn::Mul(l1, l1)),
                             hn::Add(hn::Mul(k0, k0), hn::Mul(k1, k1)));
      const auto q = hn::Div(hn::Mul(hn::Mul(r, r), hn::LoadU(d, c.weight + i)), s);
      const auto cap = hn::LoadU(d, c.cap + i);
      // 0/0 is NaN, which is not less and costs the cap.
      sum = hn::Add(sum, hn::IfThenElse(hn::Lt(q, cap), q, cap));
    }
    hn::StoreU(sum, d, sums + lane);
  }
  return pairwise_sum<kFloatBlock>(sums);
}

struct CameraLanes {
  hn::Vec<Doubles> r0, r1, r2, r3, r4, r5, r6, r7, r8, l0, l1, l2, t0, t1, t2, fx, fy;
};

HWY_INLINE CameraLanes Broadcast(Doubles d, const RefineCamera& c) {
  return {hn::Set(d, c.R[0]),     hn::Set(d, c.R[1]),     hn::Set(d, c.R[2]),
          hn::Set(d, c.R[3]),     hn::Set(d, c.R[4]),     hn::Set(d, c.R[5]),
          hn::Set(d, c.R[6]),     hn::Set(d, c.R[7]),     hn::Set(d, c.R[8]),
          hn::Set(d, c.lever[0]), hn::Set(d, c.lever[1]), hn::Set(d, c.lever[2]),
          hn::Set(d, c.t[0]),     hn::Set(d, c.t[1]),     hn::Set(d, c.t[2]),
          hn::Set(d, c.fx),       hn::Set(d, c.fy)};
}

NormalSums NormalEquations(const RefineColumns& c, std::size_t n, const RefineCamera& camera,
                           double inverse_scale, double huber, double min_depth,
                           double behind_cost) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const CameraLanes m = Broadcast(d, camera);
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0), near = hn::Set(d, min_depth);
  const auto scale2 = hn::Set(d, inverse_scale * inverse_scale), k = hn::Set(d, huber),
             k2 = hn::Set(d, huber * huber);
  const auto twice_k = hn::Set(d, 2.0 * huber), behind = hn::Set(d, behind_cost);
  HWY_ALIGN double sums[28][kDoubleBlock];
  for (std::size_t lane = 0; lane < kDoubleBlock; lane += lanes) {
    auto h00 = zero, h01 = zero, h02 = zero, h03 = zero, h04 = zero, h05 = zero, h11 = zero,
         h12 = zero, h13 = zero, h14 = zero, h15 = zero, h22 = zero, h23 = zero, h24 = zero,
         h25 = zero, h33 = zero, h35 = zero, h44 = zero, h45 = zero, h55 = zero;
    auto g0 = zero, g1 = zero, g2 = zero, g3 = zero, g4 = zero, g5 = zero, cost = zero;
    for (std::size_t i = lane; i < n; i += kDoubleBlock) {
      const auto x = hn::LoadU(d, c.x + i), y = hn::LoadU(d, c.y + i), z = hn::LoadU(d, c.z + i);
      const auto qx = hn::Add(dot3<Doubles>(m.r0, m.r1, m.r2, x, y, z), m.l0);
      const auto qy = hn::Add(dot3<Doubles>(m.r3, m.r4, m.r5, x, y, z), m.l1);
      const auto qz = hn::Add(dot3<Doubles>(m.r6, m.r7, m.r8, x, y, z), m.l2);
      const auto Z = hn::Add(qz, m.t2);
      const auto front = hn::Gt(Z, near);
      const auto iz = hn::Div(one, hn::IfThenElse(front, Z, one));
      const auto px = hn::Mul(hn::Add(qx, m.t0), iz), py = hn::Mul(hn::Add(qy, m.t1), iz);
      const auto ru = hn::Sub(hn::LoadU(d, c.u + i), hn::Mul(m.fx, px));
      const auto rv = hn::Sub(hn::LoadU(d, c.v + i), hn::Mul(m.fy, py));
      const auto weight = hn::Mul(hn::LoadU(d, c.weight + i), scale2);
      const auto e2 = hn::Mul(hn::Add(hn::Mul(ru, ru), hn::Mul(rv, rv)), weight);
      const auto far_out = hn::Gt(e2, k2);
      const auto e = hn::Sqrt(hn::IfThenElse(far_out, e2, one));
      const auto robust = hn::IfThenElse(far_out, hn::Div(k, e), one);
      const auto rho = hn::IfThenElse(far_out, hn::Sub(hn::Mul(twice_k, e), k2), e2);
      const auto counted = hn::Gt(weight, zero);
      cost = hn::Add(cost, hn::IfThenElse(front, rho, hn::IfThenElseZero(counted, behind)));
      const auto w = hn::IfThenElseZero(front, hn::Mul(weight, robust));
      // The rows of ∂pixel/∂X are (a, 0, p) and (0, b, q); ∂/∂φ of a row g is q × g.
      const auto a = hn::Mul(m.fx, iz), b = hn::Mul(m.fy, iz);
      const auto p = hn::Neg(hn::Mul(a, px)), q = hn::Neg(hn::Mul(b, py));
      const auto u0 = hn::Mul(qy, p), u1 = hn::Sub(hn::Mul(qz, a), hn::Mul(qx, p)),
                 u2 = hn::Neg(hn::Mul(qy, a));
      const auto v0 = hn::Sub(hn::Mul(qy, q), hn::Mul(qz, b)), v1 = hn::Neg(hn::Mul(qx, q)),
                 v2 = hn::Mul(qx, b);
      const auto wu0 = hn::Mul(w, u0), wu1 = hn::Mul(w, u1), wu2 = hn::Mul(w, u2),
                 wa = hn::Mul(w, a), wp = hn::Mul(w, p);
      const auto wv0 = hn::Mul(w, v0), wv1 = hn::Mul(w, v1), wv2 = hn::Mul(w, v2),
                 wb = hn::Mul(w, b), wq = hn::Mul(w, q);
      h00 = hn::Add(h00, hn::Add(hn::Mul(wu0, u0), hn::Mul(wv0, v0)));
      h01 = hn::Add(h01, hn::Add(hn::Mul(wu0, u1), hn::Mul(wv0, v1)));
      h02 = hn::Add(h02, hn::Add(hn::Mul(wu0, u2), hn::Mul(wv0, v2)));
      h03 = hn::Add(h03, hn::Mul(wu0, a));
      h04 = hn::Add(h04, hn::Mul(wv0, b));
      h05 = hn::Add(h05, hn::Add(hn::Mul(wu0, p), hn::Mul(wv0, q)));
      h11 = hn::Add(h11, hn::Add(hn::Mul(wu1, u1), hn::Mul(wv1, v1)));
      h12 = hn::Add(h12, hn::Add(hn::Mul(wu1, u2), hn::Mul(wv1, v2)));
      h13 = hn::Add(h13, hn::Mul(wu1, a));
      h14 = hn::Add(h14, hn::Mul(wv1, b));
      h15 = hn::Add(h15, hn::Add(hn::Mul(wu1, p), hn::Mul(wv1, q)));
      h22 = hn::Add(h22, hn::Add(hn::Mul(wu2, u2), hn::Mul(wv2, v2)));
      h23 = hn::Add(h23, hn::Mul(wu2, a));
      h24 = hn::Add(h24, hn::Mul(wv2, b));
      h25 = hn::Add(h25, hn::Add(hn::Mul(wu2, p), hn::Mul(wv2, q)));
      h33 = hn::Add(h33, hn::Mul(wa, a));
      h35 = hn::Add(h35, hn::Mul(wa, p));
      h44 = hn::Add(h44, hn::Mul(wb, b));
      h45 = hn::Add(h45, hn::Mul(wb, q));
      h55 = hn::Add(h55, hn::Add(hn::Mul(wp, p), hn::Mul(wq, q)));
      g0 = hn::Add(g0, hn::Add(hn::Mul(wu0, ru), hn::Mul(wv0, rv)));
      g1 = hn::Add(g1, hn::Add(hn::Mul(wu1, ru), hn::Mul(wv1, rv)));
      g2 = hn::Add(g2, hn::Add(hn::Mul(wu2, ru), hn::Mul(wv2, rv)));
      g3 = hn::Add(g3, hn::Mul(wa, ru));
      g4 = hn::Add(g4, hn::Mul(wb, rv));
      g5 = hn::Add(g5, hn::Add(hn::Mul(wp, ru), hn::Mul(wq, rv)));
    }
    const auto keep = [&](std::size_t at, hn::Vec<Doubles> v)
                          HWY_ATTR { hn::StoreU(v, d, sums[at] + lane); };
    keep(0, h00), keep(1, h01), keep(2, h02), keep(3, h03), keep(4, h04), keep(5, h05);
    keep(6, h11), keep(7, h12), keep(8, h13), keep(9, h14), keep(10, h15);
    keep(11, h22), keep(12, h23), keep(13, h24), keep(14, h25);
    keep(15, h33), keep(16, zero), keep(17, h35), keep(18, h44), keep(19, h45), keep(20, h55);
    keep(21, g0), keep(22, g1), keep(23, g2), keep(24, g3), keep(25, g4), keep(26, g5),
        keep(27, cost);
  }
  NormalSums out;
  for (std::size_t i = 0; i < 21; ++i) out.H[i] = pairwise_sum<kDoubleBlock>(sums[i]);
  for (std::size_t i = 0; i < 6; ++i) out.g[i] = pairwise_sum<kDoubleBlock>(sums[21 + i]);
  out.cost = pairwise_sum<kDoubleBlock>(sums[27]);
  return out;
}

void SquaredErrors(const RefineColumns& c, std::size_t n, const RefineCamera& camera,
                   double min_depth, double behind, double* out) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const CameraLanes m = Broadcast(d, camera);
  const auto one = hn::Set(d, 1.0), near = hn::Set(d, min_depth), none = hn::Set(d, behind);
  for (std::size_t i = 0; i < n; i += lanes) {
    const auto x = hn::LoadU(d, c.x + i), y = hn::LoadU(d, c.y + i), z = hn::LoadU(d, c.z + i);
    const auto X = hn::Add(hn::Add(dot3<Doubles>(m.r0, m.r1, m.r2, x, y, z), m.l0), m.t0);
    const auto Y = hn::Add(hn::Add(dot3<Doubles>(m.r3, m.r4, m.r5, x, y, z), m.l1), m.t1);
    const auto Z = hn::Add(hn::Add(dot3<Doubles>(m.r6, m.r7, m.r8, x, y, z), m.l2), m.t2);
    const auto front = hn::Gt(Z, near);
    const auto iz = hn::Div(one, hn::IfThenElse(front, Z, one));
    const auto ru = hn::Sub(hn::LoadU(d, c.u + i), hn::Mul(m.fx, hn::Mul(X, iz)));
    const auto rv = hn::Sub(hn::LoadU(d, c.v + i), hn::Mul(m.fy, hn::Mul(Y, iz)));
    const auto e2 = hn::Mul(hn::Add(hn::Mul(ru, ru), hn::Mul(rv, rv)), hn::LoadU(d, c.weight + i));
    hn::StoreU(hn::IfThenElse(front, e2, none), d, out + i);
  }
}

}  // namespace vergence::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::detail {

HWY_EXPORT(ProjectionCost);
HWY_EXPORT(SampsonCost);
HWY_EXPORT(NormalEquations);
HWY_EXPORT(SquaredErrors);

float projection_cost(const ScoreColumns& columns, std::size_t first, std::size_t last,
                      const ProjectionRows& rows, float min_depth) noexcept {
  return HWY_DYNAMIC_DISPATCH(ProjectionCost)(columns, first, last, rows, min_depth);
}

float sampson_cost(const MatchColumns& columns, std::size_t first, std::size_t last,
                   const std::array<float, 9>& E) noexcept {
  return HWY_DYNAMIC_DISPATCH(SampsonCost)(columns, first, last, E);
}

NormalSums normal_sums(const RefineColumns& columns, std::size_t n, const RefineCamera& camera,
                       double inverse_scale, double huber, double min_depth,
                       double behind_cost) noexcept {
  return HWY_DYNAMIC_DISPATCH(NormalEquations)(columns, n, camera, inverse_scale, huber, min_depth,
                                               behind_cost);
}

void squared_errors(const RefineColumns& columns, std::size_t n, const RefineCamera& camera,
                    double min_depth, double behind, double* out) noexcept {
  HWY_DYNAMIC_DISPATCH(SquaredErrors)(columns, n, camera, min_depth, behind, out);
}

}  // namespace vergence::detail
#endif
