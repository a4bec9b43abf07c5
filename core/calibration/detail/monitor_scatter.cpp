#include "core/calibration/detail/monitor_scatter.hpp"

#include "core/math/linear_solve.hpp"

namespace vergence::calibration::detail {
namespace {

constexpr double kMostOfExpected = 20;  // a block that lies farther off than so many times what is
                                        // expected is a change, no scatter
constexpr double kMostBlocks = 60;      // that are remembered: half a minute at 30 Hz

}  // namespace

void BlockScatter::add(const Evidence& block, const Evidence& past, double lambda) noexcept {
  if (!(block.n > 0) || !(past.n > 0)) return;
  const Mat5 A = information(block), P = information(past);
  const Cholesky<5> of_block(A), of_past(P);
  if (!of_block.ok() || !of_past.ok()) return;
  const Vec5 d = of_block.solve(Vec5(Eigen::Map<const Vec5>(block.g.data()))) -
                 of_past.solve(Vec5(Eigen::Map<const Vec5>(past.g.data())));
  const double by_noise = lambda * (kTheta + (A * of_past.inverse()).trace());
  const double scatter = (d.dot(A * d) - by_noise) / (kTheta * block.n);
  const double most = kMostOfExpected * std::max(variance(), lambda / block.n);
  if (!(scatter < most)) return;  // also refuses NaN
  if (static_cast<double>(blocks_) >= kMostBlocks) {
    sum_ *= (kMostBlocks - 1) / kMostBlocks;
    --blocks_;
  }
  sum_ += scatter;
  ++blocks_;
}

}  // namespace vergence::calibration::detail
