#pragma once
#include <array>
#include <span>

#include "core/bundle/detail/kernels.hpp"
#include "core/bundle/detail/shared_prior.hpp"
#include "core/bundle/detail/workspace.hpp"

namespace vergence::detail {

/// Normal equations of the bundle adjustment about one state with eliminated points: A δ = rhs, δ =
/// [poses | θ_S].
///
/// Not thread-safe; on the stack of solve(). Uses the workspace's memory.
class System {
 public:
  System(BundleWorkspace& workspace, const BundleProblem& problem,
         const BundleOptions& options) noexcept;

  /// Sets the layout of θ_S.
  void use(const SharedLayout& shared) noexcept;

  /// Computes cost, gradient and damped reduced system about `state`. Returns false if an observed
  /// point is behind its camera or the cost is not finite.
  [[nodiscard]] bool linearise(const BundleState& state, double damping) noexcept;
  /// Computes the cost only; `squared`: writes |ε|²/σ² of every slot to the workspace.
  [[nodiscard]] bool evaluate(const BundleState& state, bool squared) noexcept;
  /// Sets *candidate to `state` moved by `delta` (solution of the reduced system), with points by
  /// back substitution. Precondition: the last linearise() was about `state`.
  void move(const BundleState& state, const double* delta, BundleState* candidate) noexcept;

  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  [[nodiscard]] std::size_t ld() const noexcept { return ld_; }
  [[nodiscard]] double cost() const noexcept { return cost_; }
  [[nodiscard]] double squared_px() const noexcept { return job_.squared_px; }
  [[nodiscard]] double weighted() const noexcept { return job_.weighted; }
  /// |δ|² and |θ|² of the last move().
  [[nodiscard]] double update_squared() const noexcept { return update_; }
  [[nodiscard]] double norm_squared() const noexcept { return norm_; }
  [[nodiscard]] const KernelJob& job() const noexcept { return job_; }
  [[nodiscard]] const SharedPrior& shared_prior() const noexcept { return shared_prior_; }

 private:
  void prepare(const BundleState& state) noexcept;
  /// The parts of the arrays that the problem uses.
  [[nodiscard]] std::array<std::span<double>, 5> used(const BundleSums& sums) const noexcept;
  void linearise_part(KernelJob& job, const BundleSums& sums, std::size_t first,
                      std::size_t last) noexcept;
  void linearise_halves() noexcept;
  void assemble(const BundleState& state) noexcept;
  void assemble_pose(std::size_t pose) noexcept;
  void assemble_intrinsics() noexcept;
  void add_priors(const BundleState& state) noexcept;
  [[nodiscard]] double prior_cost(const BundleState& state) const noexcept;
  double& at(std::size_t row, std::size_t column) noexcept { return w_.A[column * ld_ + row]; }
  void add_information(std::size_t row, std::size_t column, double value) noexcept;

  BundleWorkspace& w_;
  const BundleProblem& problem_;
  const BundleOptions& options_;
  KernelJob job_;
  SharedPrior shared_prior_{};
  std::size_t rows_ = 0, ld_ = 0, first_shared_ = 0;
  double cost_ = 0, update_ = 0, norm_ = 0;
};

/// J (6 × size): how (τ, φ) of camera k follows from its rows of θ_S.
[[nodiscard]] Eigen::Matrix<double, 6, 6> extrinsic_basis(const SharedLayout& shared,
                                                          const KernelCamera& camera,
                                                          int k) noexcept;

}  // namespace vergence::detail
