#include "core/comparison/path_ratio.hpp"

#include <algorithm>
#include <cmath>

#include "core/comparison/comparison.hpp"

namespace vergence {
namespace {

// Number of sigmas by which the ratio must differ.
constexpr double kSigmas = 4.0;

}  // namespace

void PathRatio::add(const Vec3& estimate, const Vec3& ins, double position_sigma,
                    const ComparisonOptions& options) noexcept {
  if (!last_) {
    last_ = {estimate, ins};
    return;
  }
  const double length = (estimate - last_->estimate).norm();
  if (!(length >= options.scale_stretch_m / kSteps)) return;
  steps_[static_cast<std::size_t>(count_ % kSteps)] = {length, (ins - last_->ins).norm()};
  ++count_;
  last_ = {estimate, ins};
  if (count_ >= kSteps) measure(position_sigma, options);
}

void PathRatio::measure(double position_sigma, const ComparisonOptions& options) noexcept {
  Step sum;
  for (const Step& step : steps_) {
    sum.estimate += step.estimate;
    sum.ins += step.ins;
  }
  ratio_ = sum.ins > 0 ? sum.estimate / sum.ins : 0.0;
  // Errors of neighbouring fixes are correlated, so only those of both ends of the stretch matter.
  const double sigma = std::numbers::sqrt2 * position_sigma / options.scale_stretch_m;
  disagrees_ =
      ratio_ > 0 && std::abs(ratio_ - 1.0) > std::max(options.scale_tolerance, kSigmas * sigma);
}

}  // namespace vergence
