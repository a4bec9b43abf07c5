#pragma once
#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// Checks a problem and lays it out for the kernels, with points sorted by the poses that see them,
/// in batches of eight. Returns false with the reason in *result. Reads the problem's arrays only
/// within their sizes.
[[nodiscard]] bool set_up(BundleWorkspace& w, const BundleProblem& problem,
                          const BundleOptions& options, BundleResult* result) noexcept;

/// Layout of the rows of θ_S. `held_too`: includes fixed but uncertain intrinsics, for the total
/// covariance.
[[nodiscard]] SharedLayout shared_layout(const BundleProblem& problem, const BundleOptions& options,
                                         bool held_too) noexcept;

/// Standard deviation of a fixed intrinsic parameter by the default rule of BundleIntrinsics.
[[nodiscard]] double held_sigma(const BundleIntrinsics& intrinsics, const Intrinsics& k,
                                int parameter) noexcept;

/// fx fy cx cy d0 … d4.
[[nodiscard]] std::array<double, kIntrinsicsSize> parameters(const Intrinsics& k) noexcept;
void set_parameters(Intrinsics& k, const std::array<double, kIntrinsicsSize>& values) noexcept;

}  // namespace vergence::detail
