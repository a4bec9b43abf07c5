#pragma once
#include "core/bundle/detail/system.hpp"

namespace vergence::detail {

/// Variance of the gradient of θ_S by the tracks with points and poses eliminated: by track, or by
/// image cells and blocks of frames (BundleOptions::cells). Precondition: `system` was linearised
/// about `state` without damping, and L_SI in the workspace's A is replaced by L_SI L_II⁻¹.
[[nodiscard]] SharedMatrix track_variance(const BundleWorkspace& w, const BundleProblem& problem,
                                          const BundleOptions& options, const BundleState& state,
                                          const System& system) noexcept;

}  // namespace vergence::detail
