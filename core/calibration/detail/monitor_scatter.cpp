#include "core/calibration/detail/monitor_scatter.hpp"

#include "core/math/linear_solve.hpp"

namespace vergence::calibration::detail {
namespace {

// Ratio to the expected scatter above which a block's offset is a change of the rig.
constexpr double kMaxOfExpected = 20;
// Length of the running mean, in blocks: half a minute at 30 Hz.
constexpr std::uint64_t kMaxBlocks = 60;

}  // namespace

void BlockScatter::add(const Evidence& block, const Evidence& past, double lambda) noexcept {
  if (!(block.n > 0) || !(past.n > 0)) return;
  const Cholesky<5> of_block(block.A), of_past(past.A);
  if (!of_block.ok() || !of_past.ok()) return;
  const Vec5 d = of_block.solve(block.g) - of_past.solve(past.g);
  const double by_noise = lambda * (kTheta + (block.A * of_past.inverse()).trace());
  const double scatter = (d.dot(block.A * d) - by_noise) / (kTheta * block.n);
  const double limit = kMaxOfExpected * std::max(variance(), lambda / block.n);
  // The comparison also rejects NaN.
  if (!(scatter < limit)) return;
  if (blocks_ == kMaxBlocks) {
    sum_ -= sum_ / static_cast<double>(blocks_);
    --blocks_;
  }
  sum_ += scatter;
  ++blocks_;
}

}  // namespace vergence::calibration::detail
