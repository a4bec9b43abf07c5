// One pass over the observations: residuals, normal equations, eliminated points. Compiled once per
// SIMD target.
//
// Every lane is a point. With F = ∂x/∂X_i (2×3, X_i the point in the base camera) all derivatives
// of core/README.md are F times a factor independent of the camera, in the parametrisation of
// bundle.hpp:
//     pose (τ, φ):       B = F [ I  −[X_i]× ]
//     camera k (τ, φ):   A = F [ I  −[X_i]× ]
//     point:             C = F R_i
// A camera's perturbation is in the base camera's axes. So one 3×3 matrix Q = Σ FᵀwF per pose and
// camera suffices: P += R_iᵀ Q R_i, O = [I; [X_i]×] Q R_i, and the sums of Bᵀ w B over the points
// of one camera are its share of I, M and S.
#include <algorithm>
#include <bit>

#include "core/bundle/detail/kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/bundle/detail/normal_equations.cpp"
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

// Minimum relative pivot of a point's 3×3 block; below it the direction is unobserved and is not
// moved.
constexpr double kPivotTolerance = 1e-13;

/// Adds Bᵀ (Q, q) B with B = [I −[X]×]: 21 elements of the symmetric 6×6 (tt 6, φt 9 row-major, φφ
/// 6), then the gradient.
HWY_INLINE void add_pose_sums(const V Q[6], const V q[3], const V X[3], double* HWY_RESTRICT sums) {
  constexpr int kSym[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  constexpr int kUpper[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) add_to(Q[i], sums + i * kBatch);
  // [X]× Q.
  V C[3][3];
#pragma GCC unroll 3
  for (int c = 0; c < 3; ++c)
#pragma GCC unroll 3
    for (int r = 0; r < 3; ++r) {
      const int a = (r + 1) % 3, b = (r + 2) % 3;
      C[r][c] = hn::NegMulAdd(X[b], Q[kSym[a][c]], hn::Mul(X[a], Q[kSym[b][c]]));
      add_to(C[r][c], sums + (6 + 3 * r + c) * kBatch);
    }
    // Row r of C, crossed: X × C_r.
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    const int r = kUpper[i][0], a = (kUpper[i][1] + 1) % 3, b = (kUpper[i][1] + 2) % 3;
    double* at = sums + (15 + i) * kBatch;
    store(hn::NegMulAdd(X[b], C[r][a], hn::MulAdd(X[a], C[r][b], load(at))), at);
  }
#pragma GCC unroll 3
  for (int r = 0; r < 3; ++r) {
    const int a = (r + 1) % 3, b = (r + 2) % 3;
    add_to(q[r], sums + (21 + r) * kBatch);
    double* at = sums + (24 + r) * kBatch;
    store(hn::NegMulAdd(X[b], q[a], hn::MulAdd(X[a], q[b], load(at))), at);
  }
}

/// ∂pixel/∂(intrinsic number `index` of fx, fy, cx, cy, d0 … d4).
HWY_INLINE void by_intrinsic(const KernelCamera& camera, const Residual& r, int index, V J[2]) {
  const V zero = hn::Zero(D());
  J[0] = J[1] = zero;
  if (index < 4) {
    J[index % 2] = index < 2 ? r.distorted[index] : set(1.0);
    return;
  }
  const V r2 = hn::MulAdd(r.xn, r.xn, hn::Mul(r.yn, r.yn));
  if (!camera.equidistant && (index == 6 || index == 7)) {
    // A tangential coefficient moves its own axis, y for p1 and x for p2, by r² + 2 n² with the
    // coordinate n of that axis, and the other one by 2 x y.
    const int own = 7 - index;
    const V n = own == 0 ? r.xn : r.yn;
    J[1 - own] = hn::Mul(set(2.0), hn::Mul(r.xn, r.yn));
    J[own] = hn::MulAdd(set(2.0), hn::Mul(n, n), r2);
  } else {
    // A radial coefficient scales the point by a power of r², or of θ² times θ/r.
    const int power = !camera.equidistant && index == 8 ? 3 : index - 3;
    V factor = set(1.0), base = r2;
    if (camera.equidistant) {
      const V radius = hn::Sqrt(hn::Max(r2, set(1e-18))), theta = hn::Atan(D(), radius);
      factor = hn::Div(theta, radius);
      base = hn::Mul(theta, theta);
    }
    for (int i = 0; i < power; ++i) factor = hn::Mul(factor, base);
    J[0] = hn::Mul(factor, r.xn), J[1] = hn::Mul(factor, r.yn);
  }
  J[0] = hn::Mul(set(camera.fx), J[0]), J[1] = hn::Mul(set(camera.fy), J[1]);
}

/// Adds the intrinsics of one slot: their own equations, those with the pose, and their rows of N.
HWY_INLINE void add_intrinsics(KernelJob& job, int camera, const Residual& r, std::size_t lane,
                               std::uint16_t pose, V wx, V wy, const V F[6], V weight,
                               const V Xi[3], const double* R, double* HWY_RESTRICT rows) {
  const int count = job.shared.intrinsic_count[camera];
  double* own =
      job.intrinsic_own +
      static_cast<std::size_t>(camera) * kIntrinsicsSize * (kIntrinsicsSize + 1) * kBatch + lane;
  double* with_pose =
      job.intrinsic_sums +
      (static_cast<std::size_t>(pose) * kMaxCameras + static_cast<std::size_t>(camera)) *
          kIntrinsicsSize * 6 * kBatch +
      lane;
  V J[kIntrinsicsSize][2];
  for (int i = 0; i < count; ++i) {
    by_intrinsic(job.cameras[camera], r, job.shared.intrinsic_index[camera][i], J[i]);
    const V jx = J[i][0], jy = J[i][1];
    for (int k = 0; k <= i; ++k)
      add_to(hn::Mul(weight, hn::MulAdd(jx, J[k][0], hn::Mul(jy, J[k][1]))),
             own + (i * (kIntrinsicsSize + 1) + k) * kBatch);
    add_to(hn::MulAdd(jx, wx, hn::Mul(jy, wy)),
           own + (i * (kIntrinsicsSize + 1) + kIntrinsicsSize) * kBatch);
    // w Jᵀ F.
    V h[3];
    for (int c = 0; c < 3; ++c) h[c] = hn::Mul(weight, hn::MulAdd(jx, F[c], hn::Mul(jy, F[3 + c])));
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      add_to(h[c], with_pose + (i * 6 + c) * kBatch);
      add_to(hn::NegMulAdd(Xi[b], h[a], hn::Mul(Xi[a], h[b])),
             with_pose + (i * 6 + 3 + c) * kBatch);
      add_to(hn::MulAdd(h[0], set(R[c]),
                        hn::MulAdd(h[1], set(R[3 + c]), hn::Mul(h[2], set(R[6 + c])))),
             rows + ((job.shared.intrinsic[camera] + i) * 3 + c) * kBatch);
    }
  }
}

/// Linearises one batch's lanes [lane, lane + vector). kLenses: as in project().
template <bool kLenses>
HWY_INLINE void linearise_lanes(KernelJob& job, std::size_t index, std::size_t lane) {
  const D d;
  const Batch& batch = job.batches[index];
  const std::size_t shared_blocks = static_cast<std::size_t>(job.shared.blocks);
  double* const rows = job.y_shared + index * shared_blocks * kYSize + lane;
  const V zero = hn::Zero(d), one = set(1.0);
  for (std::size_t i = 0; i < shared_blocks * kBlock * 3; ++i) store(zero, rows + i * kBatch);

  V X[3], P[6], e[3];
  for (int r = 0; r < 3; ++r)
    X[r] = load(job.points + (index * 3 + static_cast<std::size_t>(r)) * kBatch + lane);
  for (V& p : P) p = zero;
  for (V& g : e) g = zero;
  V min_depth = set(kFar), cost = zero, squared = zero, weighted = zero, behind = zero;
  const bool robust = job.loss != BundleLoss::none;

  for (std::uint32_t at = batch.block_begin; at < batch.block_end; ++at) {
    const PoseBlock& block = job.blocks[at];
    const KernelPose& pose = job.poses[block.pose];
    const double* R = pose.R;
    V Xi[3], T[3][3], q_all[3];
    transform(R, pose.t, X, Xi);
    for (int r = 0; r < 3; ++r) {
      q_all[r] = zero;
      for (int c = 0; c < 3; ++c) T[r][c] = zero;
    }
    const Slot* slot = job.slots + block.slot;
    for (int k = 0; k < job.classes; ++k) {
      unsigned mask = block.cameras & job.class_cameras[k];
      if (mask == 0) continue;
      V Q[6], q[3];
      for (V& v : Q) v = zero;
      for (V& v : q) v = zero;
      for (; mask != 0; mask &= mask - 1, ++slot) {
        const int number = std::countr_zero(mask);
        const KernelCamera& camera = job.cameras[number];
        const Residual r = project<kLenses>(camera, *slot, lane, Xi, &behind);
        const V r2 = hn::MulAdd(r.x, r.x, hn::Mul(r.y, r.y));
        const V s = hn::Mul(r.weight, r2);
        V w = r.weight;
        if (robust) {
          V factor;
          cost = hn::Add(cost, loss(job.loss, job.threshold2, s, &factor));
          w = hn::Mul(w, factor);
          weighted = hn::MulAdd(w, r2, weighted);
        } else {
          cost = hn::Add(cost, s);
        }
        squared = hn::Add(squared, hn::IfThenElseZero(hn::Gt(r.weight, zero), r2));
        min_depth = hn::Min(min_depth, r.depth);
        const V wx = hn::Mul(w, r.x), wy = hn::Mul(w, r.y);
        // F = [a 0 −a xn; 0 b −b yn].
        if (!kLenses && camera.identity) {
          const V a = hn::Mul(set(camera.fx), r.iz), b = hn::Mul(set(camera.fy), r.iz);
          const V wa = hn::Mul(w, a), wb = hn::Mul(w, b), ax = hn::Mul(a, r.xn),
                  by = hn::Mul(b, r.yn);
          Q[0] = hn::MulAdd(wa, a, Q[0]);
          Q[2] = hn::NegMulAdd(wa, ax, Q[2]);
          Q[3] = hn::MulAdd(wb, b, Q[3]);
          Q[4] = hn::NegMulAdd(wb, by, Q[4]);
          Q[5] = hn::MulAdd(hn::Mul(w, ax), ax, hn::MulAdd(hn::Mul(w, by), by, Q[5]));
          q[0] = hn::MulAdd(a, wx, q[0]);
          q[1] = hn::MulAdd(b, wy, q[1]);
          q[2] = hn::NegMulAdd(ax, wx, hn::NegMulAdd(by, wy, q[2]));
          continue;
        }
        V F[6];
        // G R_k.
        const V a = hn::Mul(set(camera.fx), r.iz), b = hn::Mul(set(camera.fy), r.iz);
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) {
          const V axis = set(camera.R[6 + c]);
          const V x = hn::NegMulAdd(r.xn, axis, set(camera.R[c])),
                  y = hn::NegMulAdd(r.yn, axis, set(camera.R[3 + c]));
          F[c] = hn::Mul(a, kLenses ? hn::MulAdd(r.J[0], x, hn::Mul(r.J[1], y)) : x);
          F[3 + c] = hn::Mul(b, kLenses ? hn::MulAdd(r.J[1], x, hn::Mul(r.J[2], y)) : y);
        }
        V wF[6];
#pragma GCC unroll 6
        for (int i = 0; i < 6; ++i) wF[i] = hn::Mul(w, F[i]);
        Q[0] = hn::MulAdd(wF[0], F[0], hn::MulAdd(wF[3], F[3], Q[0]));
        Q[1] = hn::MulAdd(wF[0], F[1], hn::MulAdd(wF[3], F[4], Q[1]));
        Q[2] = hn::MulAdd(wF[0], F[2], hn::MulAdd(wF[3], F[5], Q[2]));
        Q[3] = hn::MulAdd(wF[1], F[1], hn::MulAdd(wF[4], F[4], Q[3]));
        Q[4] = hn::MulAdd(wF[1], F[2], hn::MulAdd(wF[4], F[5], Q[4]));
        Q[5] = hn::MulAdd(wF[2], F[2], hn::MulAdd(wF[5], F[5], Q[5]));
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) q[c] = hn::MulAdd(F[c], wx, hn::MulAdd(F[3 + c], wy, q[c]));
        if (kLenses && job.shared.intrinsic_count[number] > 0)
          add_intrinsics(job, number, r, lane, block.pose, wx, wy, F, w, Xi, R, rows);
      }

      // Class k > 0 is camera k if it is free.
      const bool moving = k > 0;
      if (moving || pose.block >= 0)
        add_pose_sums(
            Q, q, Xi,
            job.sums +
                (static_cast<std::size_t>(block.pose) * static_cast<std::size_t>(job.classes) +
                 static_cast<std::size_t>(k)) *
                    kPoseSums * kBatch +
                lane);
      // Q R_i.
      V Tk[3][3];
#pragma GCC unroll 3
      for (int c = 0; c < 3; ++c) {
        const V r0 = set(R[c]), r1 = set(R[3 + c]), r2 = set(R[6 + c]);
        Tk[0][c] = hn::MulAdd(Q[0], r0, hn::MulAdd(Q[1], r1, hn::Mul(Q[2], r2)));
        Tk[1][c] = hn::MulAdd(Q[1], r0, hn::MulAdd(Q[3], r1, hn::Mul(Q[4], r2)));
        Tk[2][c] = hn::MulAdd(Q[2], r0, hn::MulAdd(Q[4], r1, hn::Mul(Q[5], r2)));
      }
      // Rows of N before the basis: three of τ, then φ.
      if (moving) {
        double* N = rows + job.shared.extrinsic[k] * 3 * kBatch;
        const int phi = job.shared.exact[k] ? 2 : 3;
        const double* basis = job.cameras[k].basis.data();
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) {
          if (job.shared.exact[k]) {
            for (int b = 0; b < 2; ++b)
              add_to(hn::MulAdd(set(basis[b]), Tk[0][c],
                                hn::MulAdd(set(basis[2 + b]), Tk[1][c],
                                           hn::Mul(set(basis[4 + b]), Tk[2][c]))),
                     N + (3 * b + c) * kBatch);
          } else {
            for (int r = 0; r < 3; ++r) add_to(Tk[r][c], N + (3 * r + c) * kBatch);
          }
          for (int r = 0; r < 3; ++r) {
            const int a = (r + 1) % 3, b = (r + 2) % 3;
            add_to(hn::NegMulAdd(Xi[b], Tk[a][c], hn::Mul(Xi[a], Tk[b][c])),
                   N + (3 * (phi + r) + c) * kBatch);
          }
        }
      }
#pragma GCC unroll 3
      for (int r = 0; r < 3; ++r) {
        q_all[r] = hn::Add(q_all[r], q[r]);
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) T[r][c] = hn::Add(T[r][c], Tk[r][c]);
      }
    }
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) {
      const V r0 = set(R[c]), r1 = set(R[3 + c]), r2 = set(R[6 + c]);
      e[c] = hn::MulAdd(r0, q_all[0], hn::MulAdd(r1, q_all[1], hn::MulAdd(r2, q_all[2], e[c])));
      constexpr int kRow[3] = {0, 3, 5};
#pragma GCC unroll 3
      for (int k = c; k < 3; ++k) {
        V& p = P[kRow[c] + k - c];
        p = hn::MulAdd(r0, T[0][k], hn::MulAdd(r1, T[1][k], hn::MulAdd(r2, T[2][k], p)));
      }
    }
    if (pose.block >= 0) {
      double* y = job.y + static_cast<std::size_t>(at) * kYTop + lane;
#pragma GCC unroll 3
      for (int r = 0; r < 3; ++r)
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) store(T[r][c], y + (3 * r + c) * kBatch);
    }
  }

  // Factorise P (1 + λ on the diagonal) = L Lᵀ and invert L. For constant points the inverse is 0,
  // so they drop out.
  const V grow = set(1.0 + job.damping), tolerance = set(kPivotTolerance),
          free = load(job.point_free + index * kBatch + lane);
  const V d0 = hn::Mul(P[0], grow), d1 = hn::Mul(P[3], grow), d2 = hn::Mul(P[5], grow);
  const auto inverse_root = [&](V pivot, V diagonal) {
    const auto good = hn::Gt(pivot, hn::Mul(tolerance, diagonal));
    return hn::Mul(
        free, hn::IfThenElseZero(good, hn::Div(one, hn::Sqrt(hn::IfThenElse(good, pivot, one)))));
  };
  const V m00 = inverse_root(d0, d0);
  const V l10 = hn::Mul(P[1], m00), l20 = hn::Mul(P[2], m00);
  const V m11 = inverse_root(hn::NegMulAdd(l10, l10, d1), d1);
  const V l21 = hn::Mul(hn::NegMulAdd(l20, l10, P[4]), m11);
  const V m22 = inverse_root(hn::NegMulAdd(l20, l20, hn::NegMulAdd(l21, l21, d2)), d2);
  const V m10 = hn::Neg(hn::Mul(hn::Mul(l10, m00), m11));
  const V m21 = hn::Neg(hn::Mul(hn::Mul(l21, m11), m22));
  const V m20 = hn::Neg(hn::Mul(m22, hn::MulAdd(l20, m00, hn::Mul(l21, m10))));
  const V z[3] = {hn::Mul(m00, e[0]), hn::MulAdd(m10, e[0], hn::Mul(m11, e[1])),
                  hn::MulAdd(m20, e[0], hn::MulAdd(m21, e[1], hn::Mul(m22, e[2])))};
  double* factor = job.factors + index * kFactorRows * kBatch + lane;
  const V stored[10] = {m00, m10, m11, m20, m21, m22, z[0], z[1], z[2], min_depth};
#pragma GCC unroll 10
  for (int i = 0; i < 10; ++i) store(stored[i], factor + i * kBatch);

  for (std::uint32_t at = batch.block_begin; at < batch.block_end; ++at) {
    const KernelPose& pose = job.poses[job.blocks[at].pose];
    if (pose.block < 0) continue;
    V Xi[3], Y[3][3];
    transform(pose.R, pose.t, X, Xi);
    double* y = job.y + static_cast<std::size_t>(at) * kYTop + lane;
    double* whole = job.y_group + (at - job.group_begin) * kYSize + lane;
    double* g = job.reduced + static_cast<std::size_t>(pose.block) * kBlock * kBatch + lane;
#pragma GCC unroll 3
    for (int r = 0; r < 3; ++r) {
      const V t0 = load(y + (3 * r) * kBatch), t1 = load(y + (3 * r + 1) * kBatch),
              t2 = load(y + (3 * r + 2) * kBatch);
      Y[r][0] = hn::Mul(t0, m00);
      Y[r][1] = hn::MulAdd(t0, m10, hn::Mul(t1, m11));
      Y[r][2] = hn::MulAdd(t0, m20, hn::MulAdd(t1, m21, hn::Mul(t2, m22)));
    }
#pragma GCC unroll 3
    for (int r = 0; r < 3; ++r) {
      const int a = (r + 1) % 3, b = (r + 2) % 3;
      V top = load(g + r * kBatch), bottom = load(g + (3 + r) * kBatch);
#pragma GCC unroll 3
      for (int c = 0; c < 3; ++c) {
        const V turned = hn::NegMulAdd(Xi[b], Y[a][c], hn::Mul(Xi[a], Y[b][c]));
        store(Y[r][c], y + (3 * r + c) * kBatch);
        store(Y[r][c], whole + (3 * r + c) * kBatch);
        store(turned, whole + (9 + 3 * r + c) * kBatch);
        top = hn::MulAdd(Y[r][c], z[c], top);
        bottom = hn::MulAdd(turned, z[c], bottom);
      }
      store(top, g + r * kBatch);
      store(bottom, g + (3 + r) * kBatch);
    }
  }
  for (int i = 0; i < job.shared.size; ++i) {
    double* n = rows + i * 3 * kBatch;
    double* g =
        job.reduced +
        (static_cast<std::size_t>(job.free_poses) * kBlock + static_cast<std::size_t>(i)) * kBatch +
        lane;
    const V n0 = load(n), n1 = load(n + kBatch), n2 = load(n + 2 * kBatch);
    const V y0 = hn::Mul(n0, m00), y1 = hn::MulAdd(n0, m10, hn::Mul(n1, m11)),
            y2 = hn::MulAdd(n0, m20, hn::MulAdd(n1, m21, hn::Mul(n2, m22)));
    store(y0, n);
    store(y1, n + kBatch);
    store(y2, n + 2 * kBatch);
    store(hn::MulAdd(y0, z[0], hn::MulAdd(y1, z[1], hn::MulAdd(y2, z[2], load(g)))), g);
  }

  const double sum = total(cost);
  job.cost += 0.5 * sum;
  job.weighted += robust ? total(weighted) : sum;
  job.squared_px += total(squared);
  job.behind = job.behind || total(behind) > 0;
}

void linearise_one(KernelJob& job, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i)
    for (std::size_t lane = 0; lane < kBatch; lane += hn::Lanes(D()))
      job.lenses ? linearise_lanes<true>(job, i, lane) : linearise_lanes<false>(job, i, lane);
}

}  // namespace HWY_NAMESPACE
}  // namespace vergence::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vergence::detail {

HWY_EXPORT(linearise_one);

void linearise(KernelJob& job, std::size_t first, std::size_t last) noexcept {
  HWY_DYNAMIC_DISPATCH(linearise_one)(job, first, last);
}

}  // namespace vergence::detail
#endif
