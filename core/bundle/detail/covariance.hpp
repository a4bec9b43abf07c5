#pragma once
#include "core/bundle/detail/system.hpp"

namespace vergence::detail {

/// Computes *result's covariances of θ_S about `state`: white noise, cluster-robust, and total.
/// Leaves has_covariance false if the undamped system is not positive definite. Overwrites the
/// workspace's system and the candidate's arrays; call it after the last step.
void shared_covariance(BundleWorkspace& w, const BundleProblem& problem,
                       const BundleOptions& options, const BundleState& state, System& system,
                       BundleResult* result) noexcept;

}  // namespace vergence::detail
