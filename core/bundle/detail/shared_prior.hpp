#pragma once
#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// BundleSharedPrior in the rows of one layout: ½ δᵀ Λ δ, δ the way from the prior's mean in the
/// rows' own coordinates there.
///
/// The covariance is of more parameters than a layout has; the others are where the prior has them:
/// Λ is the block of the joint information that belongs to the layout's rows.
class SharedPrior {
 public:
  SharedPrior() noexcept = default;
  SharedPrior(const BundleSharedPrior& prior, const SharedLayout& layout,
              std::size_t cameras) noexcept;

  [[nodiscard]] bool used() const noexcept { return rig_ != nullptr; }
  /// Weighted; symmetric, layout.size rows.
  [[nodiscard]] const SharedMatrix& information() const noexcept { return information_; }
  [[nodiscard]] double weight() const noexcept { return weight_; }
  [[nodiscard]] SharedVector residual(const BundleState& state) const noexcept;
  /// ∂residual/∂rows at `state`, whose cameras' bases are in `job`.
  [[nodiscard]] SharedMatrix jacobian(const BundleState& state,
                                      const KernelJob& job) const noexcept;

 private:
  const RigCalibration* rig_ = nullptr;
  SharedLayout layout_{};
  std::size_t cameras_ = 0;
  double weight_ = 1;
  KernelCamera mean_[kMaxCameras]{};  // their bases
  SharedMatrix information_;
};

}  // namespace vergence::detail
