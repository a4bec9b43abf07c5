#include "core/comparison/path_ratio.hpp"

#include <algorithm>
#include <cmath>

#include "core/comparison/comparison.hpp"

namespace vergence {
namespace {

// Number of sigmas by which the ratio must differ.
constexpr double kSigmas = 4.0;

}  // namespace

void PathRatio::add(const Vec3& ours, const Vec3& ins, double position_sigma,
                    const ComparisonOptions& options) noexcept {
  if (!last_) {
    last_ = {ours, ins};
    return;
  }
  const double length = (ours - last_->ours).norm();
  if (!(length >= options.scale_stretch_m / kSteps)) return;
  steps_[static_cast<std::size_t>(count_ % kSteps)] = {length, (ins - last_->ins).norm()};
  ++count_;
  last_ = {ours, ins};
  if (count_ >= kSteps) measure(position_sigma, options);
}

void PathRatio::measure(double position_sigma, const ComparisonOptions& options) noexcept {
  Step sum;
  for (const Step& step : steps_) {
    sum.ours += step.ours;
    sum.ins += step.ins;
  }
  ratio_ = sum.ins > 0 ? sum.ours / sum.ins : 0.0;
  // Errors of neighbouring fixes are correlated, so only those of both ends of the stretch matter.
  const double sigma = std::numbers::sqrt2 * position_sigma / options.scale_stretch_m;
  disagrees_ =
      ratio_ > 0 && std::abs(ratio_ - 1.0) > std::max(options.scale_tolerance, kSigmas * sigma);
}

}  // namespace vergence
