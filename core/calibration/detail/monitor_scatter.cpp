#include "core/calibration/detail/monitor_scatter.hpp"

#include <cmath>

#include "core/calibration/detail/evidence_history.hpp"
#include "core/math/linear_solve.hpp"

namespace vergence::calibration::detail {

void BlockScatter::add(const Evidence& block, const Evidence& past, double lambda) noexcept {
  if (!(block.n > 0) || !(past.n > 0)) return;
  const Cholesky<5> of_block(block.A), of_past(past.A);
  if (!of_block.ok() || !of_past.ok()) return;
  const Vec5 d = of_block.solve(block.g) - of_past.solve(past.g);
  const double by_noise = lambda * (kTheta + (block.A * of_past.inverse()).trace());
  const double scatter = (d.dot(block.A * d) - by_noise) / (kTheta * block.n);
  if (!std::isfinite(scatter)) return;
  // The mean is over as many blocks as the history holds.
  constexpr auto most = static_cast<double>(EvidenceHistory::kBlocks);
  if (blocks_ >= EvidenceHistory::kBlocks) {
    sum_ *= (most - 1) / most;
    --blocks_;
  }
  sum_ += scatter;
  ++blocks_;
}

}  // namespace vergence::calibration::detail
