#pragma once
#include "core/bundle/detail/system.hpp"

namespace vergence::detail {

/// Variance of the gradient of θ_S that the tracks cause, points and poses eliminated: by track, or
/// by cells of the image and blocks of frames (BundleOptions::cells). Precondition: `system` was
/// linearised about `state` without damping, and in the place of L_SI in the workspace's A stands
/// L_SI L_II⁻¹.
[[nodiscard]] SharedMatrix track_variance(const BundleWorkspace& w, const BundleProblem& problem,
                                          const BundleOptions& options, const BundleState& state,
                                          const System& system) noexcept;

}  // namespace vergence::detail
