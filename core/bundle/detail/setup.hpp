#pragma once
#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// Checks a problem and lays it out for the kernels: points sorted by the poses that see them,
/// eight to a batch.
/// False: *result has the reason, the workspace is not to be used. Reads the problem's arrays only
/// within their sizes.
[[nodiscard]] bool set_up(BundleWorkspace& w, const BundleProblem& problem,
                          const BundleOptions& options, BundleResult* result) noexcept;

/// Which rows of θ_S there are. `held_too`: the intrinsics that are held but uncertain get rows as
/// well (for the wide covariance).
[[nodiscard]] SharedLayout shared_layout(const BundleProblem& problem, const BundleOptions& options,
                                         bool held_too) noexcept;

/// Sigma of a held intrinsic parameter with the default rule of BundleIntrinsics applied.
[[nodiscard]] double held_sigma(const BundleIntrinsics& intrinsics, const Intrinsics& k,
                                int parameter) noexcept;

/// fx fy cx cy d0 … d4.
[[nodiscard]] std::array<double, kIntrinsicsSize> parameters(const Intrinsics& k) noexcept;
void set_parameters(Intrinsics& k, const std::array<double, kIntrinsicsSize>& values) noexcept;

}  // namespace vergence::detail
