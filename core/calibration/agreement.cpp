#include "core/calibration/agreement.hpp"

#include <array>
#include <cmath>

#include "core/calibration/detail/depth.hpp"
#include "core/geometry/epipolar.hpp"
#include "core/math/linear_solve.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {

RigCovariance noise_only(const RigCovariance& wide) noexcept {
  // Share of a variance below which earlier parameters determine this one.
  constexpr double kNothingLeft = 1e-12;
  RigCovariance noise = wide;
  for (int held = intrinsic_row(0); held < intrinsic_row(0) + 4; ++held) {
    const double variance = noise(held, held);
    if (!wide.known(held) || !(variance > kNothingLeft * wide(held, held))) continue;
    std::array<double, kRigSize> with_held;
    for (int r = 0; r < kRigSize; ++r) with_held[static_cast<std::size_t>(r)] = noise(r, held);
    for (int r = 0; r < kRigSize; ++r)
      for (int c = 0; c <= r; ++c)
        noise.set(r, c,
                  noise(r, c) - with_held[static_cast<std::size_t>(r)] *
                                    with_held[static_cast<std::size_t>(c)] / variance);
  }
  return noise;
}

Agreement agreement(const RigCalibration& a, const RigCalibration& b, int k) noexcept {
  const auto c = static_cast<std::size_t>(k);
  RigCalibration first = a, second = b;
  first.covariance = noise_only(a.covariance);
  second.covariance = noise_only(b.covariance);
  Agreement result;
  const detail::DepthReader reader(b, k);
  for (std::size_t i = 0; i < Agreement::kDepths; ++i) {
    double normalised = 0, squared = 0;
    int seen = 0;
    detail::for_places(a, k, Agreement::kDepthM[i], [&](const detail::CovisiblePoint& p) noexcept {
      double relative = 0;
      if (!reader.difference(p, &relative)) return;
      const detail::DepthGradient g = detail::depth_gradient(p, a.T_camera_left[c], k, true);
      const double variance =
          detail::variance_of(first, k, g, true) + detail::variance_of(second, k, g, true);
      if (!(variance > 0)) return;
      normalised += relative * relative / variance;
      squared += relative * relative;
      ++seen;
    });
    if (seen == 0) continue;
    result.depth[i] = normalised / seen;
    result.depth_percent[i] = 100 * std::sqrt(squared / seen);
  }
  // The transform's five parameters: rotation, and t along two directions orthogonal to it.
  const Transform &Ta = a.T_camera_left[c], &Tb = b.T_camera_left[c];
  Eigen::Matrix<double, 6, 5> basis = Eigen::Matrix<double, 6, 5>::Zero();
  basis.topLeftCorner<3, 3>().setIdentity();
  basis.bottomRightCorner<3, 2>() = tangent_basis(Ta.t.normalized());
  Vec6 way;
  way << log_so3(Tb.R * Ta.R.transpose()), Tb.t - Ta.t;
  Mat6 C;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      C(i, j) = first.covariance(extrinsic_row(k) + i, extrinsic_row(k) + j) +
                second.covariance(extrinsic_row(k) + i, extrinsic_row(k) + j);
  const Mat5 own = basis.transpose() * C * basis;
  const Vec5 d = basis.transpose() * way;
  result.transform = d.dot(ldlt_solve(own, d)) / 5;
  const Intrinsics &la = a.intrinsics[c], &lb = b.intrinsics[c];
  const std::array difference = {lb.fx - la.fx, lb.fy - la.fy, lb.cx - la.cx, lb.cy - la.cy};
  for (int i = 0; i < 4; ++i) {
    const int row = intrinsic_row(k) + i;
    const double variance = first.covariance(row, row) + second.covariance(row, row);
    if (variance > 0)
      result.intrinsics += 0.25 * difference[static_cast<std::size_t>(i)] *
                           difference[static_cast<std::size_t>(i)] / variance;
  }
  return result;
}

}  // namespace vergence::calibration
