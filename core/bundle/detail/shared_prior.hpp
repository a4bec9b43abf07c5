#pragma once
#include <array>

#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// One row of the layout as a combination of at most six published parameters.
struct Combination {
  int first = 0, count = 0;
  double factor[6]{};
};
/// Row of (τ, φ) of camera k at the mean from the published (φ, τ): row r of Bᵀ [R₀ᵀ τ; R₀ᵀ φ].
[[nodiscard]] Combination extrinsic_combination(const Mat6& basis, const Mat3& R, int k,
                                                int row) noexcept;

/// BundleSharedPrior in the rows of one layout: ½ δᵀ Λ δ with δ the difference from the prior's
/// mean in the rows' coordinates.
///
/// The covariance has more parameters than a layout. The others are fixed at their prior, so Λ is
/// the layout's block of the joint information.
class SharedPrior {
 public:
  SharedPrior() noexcept = default;
  SharedPrior(const BundleSharedPrior& prior, const SharedLayout& layout,
              std::size_t cameras) noexcept;

  [[nodiscard]] bool used() const noexcept { return rig_ != nullptr; }
  /// Weighted information: symmetric, with layout.size rows.
  [[nodiscard]] const SharedMatrix& information() const noexcept { return information_; }
  [[nodiscard]] double weight() const noexcept { return weight_; }
  [[nodiscard]] SharedVector residual(const BundleState& state) const noexcept;
  /// ∂residual/∂rows at `state`; the cameras' bases are in `job`.
  [[nodiscard]] SharedMatrix jacobian(const BundleState& state,
                                      const KernelJob& job) const noexcept;

 private:
  const RigCalibration* rig_ = nullptr;
  SharedLayout layout_{};
  std::size_t cameras_ = 0;
  double weight_ = 1;
  // Only their bases are used.
  std::array<KernelCamera, kMaxCameras> mean_{};
  SharedMatrix information_;
};

}  // namespace vergence::detail
