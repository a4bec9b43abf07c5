#pragma once
#include <array>
#include <span>

#include "core/geometry/stereo_mlesac.hpp"
#include "core/math/random.hpp"
#include "core/memory/arena.hpp"
#include "core/odometry/front_end.hpp"
#include "core/types/calibration.hpp"

namespace vergence::odometry {

/// Estimates the transform between the first two cameras from the matches of one pair of images,
/// given only intrinsics and baseline length. Not thread-safe. Memory from the arena.
class RigInitialiser {
 public:
  /// `capacity`: maximum number of matches. `seed`: of the sampling.
  RigInitialiser(std::size_t capacity, std::uint64_t seed, Arena& arena);

  [[nodiscard]] StereoEstimate estimate(std::span<const FreeMatch> matches,
                                        const RigCalibration& rig) noexcept;

 private:
  StereoMlesac mlesac_;
  // Columns of the matches: left x, y, right x, y, sigma.
  std::array<std::span<double>, 5> columns_{};
  Random random_;
};

}  // namespace vergence::odometry
