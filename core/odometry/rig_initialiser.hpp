#pragma once
#include <array>
#include <span>

#include "core/geometry/stereo_mlesac.hpp"
#include "core/math/random.hpp"
#include "core/memory/arena.hpp"
#include "core/odometry/front_end.hpp"
#include "core/types/calibration.hpp"

namespace vergence::odometry {

/// The transform between the first two cameras from the matches of one pair of images, where
/// nothing but lenses and baseline length is known. Memory from the arena; threads one.
class RigInitialiser {
 public:
  /// `capacity`: matches of a pair. Draws its samples from `seed`.
  RigInitialiser(std::size_t capacity, std::uint64_t seed, Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;

  [[nodiscard]] StereoEstimate estimate(std::span<const FreeMatch> matches,
                                        const RigCalibration& rig) noexcept;

 private:
  StereoMlesac mlesac_;
  std::array<std::span<double>, 5> columns_{};  // left x, y, right x, y, sigma of the matches
  Random random_;
};

}  // namespace vergence::odometry
