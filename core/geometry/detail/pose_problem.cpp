#include "core/geometry/detail/pose_problem.hpp"

#include <cassert>
#include <limits>

#include "core/camera/camera.hpp"
#include "core/math/linear_solve.hpp"

namespace vergence::detail {
namespace {

// Cost in squared sigmas of a point behind a camera, high enough that few steps accept it.
constexpr double kBehindCost = 1e4;

}  // namespace

PoseProblem::PoseProblem(std::size_t capacity, Arena& arena, const char* who) {
  const std::size_t n = padded(capacity, kDoubleBlock);
  for (Set& s : sets_) {
    for (std::span<double>* column :
         {&s.x, &s.y, &s.z, &s.u, &s.v, &s.weight, &s.given_weight, &s.error})
      *column = arena.make<double>(n, who);
    s.point = arena.make<std::uint32_t>(n, who);
  }
}

void PoseProblem::gather(const RigObservations& o) noexcept {
  assert(o.size() <= sets_[0].point.size());
  cameras_ = o.cameras;
  for (int k = 0; k < o.cameras; ++k) {
    const auto kk = static_cast<std::size_t>(k);
    Set& s = sets_[kk];
    s.count = 0;
    s.T_camera_left = o.T_camera_left[kk];
    s.fx = o.pinhole[kk].fx;
    s.fy = o.pinhole[kk].fy;
    for (std::size_t i = 0; i < o.size(); ++i) {
      if (!o.usable(i, k)) continue;
      const std::size_t n = s.count++;
      s.point[n] = static_cast<std::uint32_t>(i);
      s.x[n] = o.x[i];
      s.y[n] = o.y[i];
      s.z[n] = o.z[i];
      s.u[n] = o.u[kk][i] - o.pinhole[kk].cx;
      s.v[n] = o.v[kk][i] - o.pinhole[kk].cy;
      s.weight[n] = s.given_weight[n] = 1.0 / (o.sigma[i] * o.sigma[i]);
    }
    s.whole = padded(s.count, kDoubleBlock);
    for (std::size_t n = s.count; n < s.whole; ++n)
      s.x[n] = s.y[n] = s.z[n] = s.u[n] = s.v[n] = s.weight[n] = 0.0;
  }
}

void PoseProblem::use(int camera, std::size_t i, bool counts) noexcept {
  Set& s = sets_[static_cast<std::size_t>(camera)];
  assert(i < s.count);
  s.weight[i] = counts ? s.given_weight[i] : 0.0;
}

RefineCamera PoseProblem::camera_at(const Set& set, const Transform& T_left_world) noexcept {
  const Mat3 R = set.T_camera_left.R * T_left_world.R;
  const Vec3 lever = set.T_camera_left.R * T_left_world.t;
  const Vec3& t = set.T_camera_left.t;
  return {{R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)},
          {lever.x(), lever.y(), lever.z()},
          {t.x(), t.y(), t.z()},
          set.fx,
          set.fy};
}

RefineColumns PoseProblem::columns(const Set& s) noexcept {
  return {s.x.data(), s.y.data(), s.z.data(), s.u.data(), s.v.data(), s.weight.data()};
}

PoseProblem::Sums PoseProblem::sums(const Transform& T_left_world, double scale,
                                    double huber) const noexcept {
  Sums out{Mat6::Zero(), Vec6::Zero(), 0.0};
  for (int k = 0; k < cameras_; ++k) {
    const Set& s = sets_[static_cast<std::size_t>(k)];
    if (s.count == 0) continue;
    const RefineCamera camera = camera_at(s, T_left_world);
    const NormalSums n =
        normal_sums(columns(s), s.whole, camera, 1.0 / scale, huber, kMinDepth, kBehindCost);
    Mat6 H;
    for (int r = 0, at = 0; r < 6; ++r)
      for (int c = r; c < 6; ++c) H(r, c) = H(c, r) = n.H[static_cast<std::size_t>(at++)];
    // With X_k = R_k X_left + t_k, the kernel's q is R_k X_left and its δ is (R_k φ, R_k τ).
    const Mat3& R = s.T_camera_left.R;
    const Vec3 g_rotation(n.g[0], n.g[1], n.g[2]), g_translation(n.g[3], n.g[4], n.g[5]);
    out.g.head<3>() += R.transpose() * g_rotation;
    out.g.tail<3>() += R.transpose() * g_translation;
    for (int a = 0; a < 6; a += 3)
      for (int b = 0; b < 6; b += 3)
        out.H.block<3, 3>(a, b) += R.transpose() * Mat3(H.block<3, 3>(a, b)) * R;
    out.cost += n.cost;
  }
  return out;
}

void PoseProblem::evaluate(const Transform& T_left_world) noexcept {
  for (int k = 0; k < cameras_; ++k) {
    Set& s = sets_[static_cast<std::size_t>(k)];
    RefineColumns c = columns(s);
    c.weight = s.given_weight.data();
    squared_errors(c, s.whole, camera_at(s, T_left_world), kMinDepth,
                   std::numeric_limits<double>::infinity(), s.error.data());
  }
}

Transform moved(const Transform& T_left_world, const Vec6& delta) noexcept {
  const Mat3 turn = exp_so3(delta.head<3>());
  return {normalised(turn * T_left_world.R), turn * T_left_world.t + delta.tail<3>()};
}

bool solve_normal(const Mat6& H, const Vec6& g, Vec6* delta) noexcept {
  // Equilibrate, because rotation and translation have different units.
  Vec6 d;
  for (int i = 0; i < 6; ++i) {
    if (!(H(i, i) > 0.0)) return false;
    d[i] = 1.0 / std::sqrt(H(i, i));
  }
  const Mat6 A = d.asDiagonal() * H * d.asDiagonal();
  const Cholesky<6> llt(A);
  if (!llt.ok()) return false;
  const Vec6 x = d.asDiagonal() * llt.solve(Vec6(d.asDiagonal() * g));
  if (!x.allFinite()) return false;
  *delta = x;
  return true;
}

}  // namespace vergence::detail
