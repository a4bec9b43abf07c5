#pragma once
#include "core/bundle/detail/system.hpp"

namespace vergence::detail {

/// Fills *result's covariances of θ_S about `state`: white noise, cluster-robust, and with fixed
/// intrinsics. Leaves has_covariance false where the undamped system is not positive definite. Uses
/// the workspace's system and the candidate's arrays; call it after the last step.
void shared_covariance(BundleWorkspace& w, const BundleProblem& problem,
                       const BundleOptions& options, const BundleState& state, System& system,
                       BundleResult* result) noexcept;

}  // namespace vergence::detail
