#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/bundle/bundle.hpp"
#include "core/bundle/detail/kernels.hpp"

namespace vergence {
namespace {

bool positive(double v) noexcept { return v > 0 && std::isfinite(v); }

bool valid(const BundleLengthConstraint& l) noexcept {
  return l.metres >= 0 && std::isfinite(l.metres) &&
         (l.kind != BundleLength::measured || (l.sigma > 0 && l.metres > 0));
}

bool valid(const BundleIntrinsics& i) noexcept {
  if (i.free >> kIntrinsicsSize != 0) return false;
  for (std::size_t k = 0; k < kIntrinsicsSize; ++k)
    if (!(i.prior_sigma[k] >= 0) || !std::isfinite(i.prior_mean[k]) || std::isnan(i.held_sigma[k]))
      return false;
  return true;
}

}  // namespace

bool BundleOptions::valid() const noexcept {
  // Reject larger values as mistakes; the longest solve of the program takes 200 steps.
  constexpr int kMaxSteps = 1000;
  constexpr double kMaxDamping = 1e6;
  const auto each_valid = [](const auto& all) {
    return std::all_of(all.begin(), all.end(),
                       [](const auto& one) { return vergence::valid(one); });
  };
  return positive(loss_threshold) && max_steps >= 1 && max_steps <= kMaxSteps &&
         tolerance_sigmas >= 0 && initial_damping > 0 && initial_damping <= kMaxDamping &&
         each_valid(length) && each_valid(intrinsics) && cells >= 0 && cells <= detail::kMaxCells &&
         positive(shared_errors) && positive(shared_prior.weight);
}

}  // namespace vergence
