#include "core/odometry/rig_initialiser.hpp"

namespace vergence::odometry {
namespace {

// Factor of a tracked corner's sigma, because patches are aligned without a known warp.
constexpr double kFreeMatchSigma = 2.0;

}  // namespace

RigInitialiser::RigInitialiser(std::size_t capacity, std::uint64_t seed, Arena& arena)
    : mlesac_(capacity, arena), random_(seed) {
  for (std::span<double>& column : columns_)
    column = arena.make<double>(capacity, "stereo matches");
}

StereoEstimate RigInitialiser::estimate(std::span<const FreeMatch> matches,
                                        const RigCalibration& rig) noexcept {
  const Intrinsics &left = rig.intrinsics[0], &right = rig.intrinsics[1];
  const std::size_t n = matches.size();
  for (std::size_t i = 0; i < n; ++i) {
    columns_[0][i] = (matches[i].left.x() - left.cx) / left.fx;
    columns_[1][i] = (matches[i].left.y() - left.cy) / left.fy;
    columns_[2][i] = (matches[i].other.x() - right.cx) / right.fx;
    columns_[3][i] = (matches[i].other.y() - right.cy) / right.fy;
    columns_[4][i] = kFreeMatchSigma * matches[i].sigma / left.fx;
  }
  const StereoMatches rays{columns_[0].first(n), columns_[1].first(n), columns_[2].first(n),
                           columns_[3].first(n), columns_[4].first(n)};
  return mlesac_.estimate_stereo_transform(rays, rig.baseline, StereoMlesacOptions{}, random_);
}

}  // namespace vergence::odometry
