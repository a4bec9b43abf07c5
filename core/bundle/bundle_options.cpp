#include <cmath>
#include <cstddef>

#include "core/bundle/bundle.hpp"
#include "core/bundle/detail/kernels.hpp"

/// What options may be, and the words of a result.
namespace vergence {

const char* BundleOptions::validate() const noexcept {
  constexpr int kMostSteps = 1000;
  constexpr double kMostDamping = 1e6;
  if (!(loss_threshold > 0) || !std::isfinite(loss_threshold))
    return "loss_threshold is not above 0";
  if (max_steps < 1 || max_steps > kMostSteps) return "max_steps is not in 1 … 1000";
  if (!(cost_tolerance >= 0)) return "cost_tolerance is negative";
  if (!(update_tolerance >= 0)) return "update_tolerance is negative";
  if (!(gradient_tolerance >= 0)) return "gradient_tolerance is negative";
  if (!(initial_damping > 0) || initial_damping > kMostDamping)
    return "initial_damping is not in (0, 1e6]";
  for (const BundleLengthConstraint& l : length) {
    if (!(l.metres >= 0) || !std::isfinite(l.metres))
      return "length: metres is negative or not a number";
    if (l.kind == BundleLength::measured && (!(l.sigma > 0) || !(l.metres > 0)))
      return "length: a measured length needs metres and sigma above 0";
  }
  if (cells < 0 || cells > detail::kMostCells) return "cells is not in 0 … 8";
  if (!(shared_errors > 0) || !std::isfinite(shared_errors)) return "shared_errors is not above 0";
  if (!(shared_prior.weight > 0) || !std::isfinite(shared_prior.weight))
    return "shared_prior: weight is not above 0";
  for (const BundleIntrinsics& i : intrinsics)
    for (std::size_t k = 0; k < kIntrinsicsSize; ++k) {
      if (!(i.prior_sigma[k] >= 0) || !std::isfinite(i.prior_mean[k]))
        return "intrinsics: a prior is not a number";
      if (std::isnan(i.held_sigma[k])) return "intrinsics: held_sigma is not a number";
      if (i.free >> kIntrinsicsSize != 0)
        return "intrinsics: free has bits beyond the nine parameters";
    }
  return "";
}

const char* to_string(BundleTermination t) noexcept {
  switch (t) {
    case BundleTermination::small_update:
      return "small_update";
    case BundleTermination::small_gradient:
      return "small_gradient";
    case BundleTermination::small_cost_change:
      return "small_cost_change";
    case BundleTermination::max_steps:
      return "max_steps";
    case BundleTermination::diverged:
      return "diverged";
    case BundleTermination::invalid_input:
      return "invalid_input";
    case BundleTermination::rank_deficient:
      return "rank_deficient";
    case BundleTermination::capacity:
      return "capacity";
  }
  return "unknown";
}

const char* to_string(BundleDefect d) noexcept {
  switch (d) {
    case BundleDefect::none:
      return "none";
    case BundleDefect::options:
      return "options";
    case BundleDefect::sizes:
      return "sizes";
    case BundleDefect::index:
      return "index";
    case BundleDefect::order:
      return "order";
    case BundleDefect::not_finite:
      return "not_finite";
    case BundleDefect::state_not_finite:
      return "state_not_finite";
    case BundleDefect::behind:
      return "behind";
    case BundleDefect::seen_once:
      return "seen_once";
    case BundleDefect::pose_without_observations:
      return "pose_without_observations";
  }
  return "unknown";
}

}  // namespace vergence
