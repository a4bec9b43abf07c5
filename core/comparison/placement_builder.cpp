#include "core/comparison/placement_builder.hpp"

#include "core/comparison/comparison.hpp"

namespace vergence {
namespace {

// m: smaller steps are the odometry's noise at a standstill, no path.
constexpr double kLeastStep = 0.05;

}  // namespace

PlacementBuilder::PlacementBuilder(const ComparisonOptions& options, Arena& arena)
    : options_(options), pairs_(arena.make<PlacementPair>(kPairs, "comparison: placement")) {}

std::size_t PlacementBuilder::bytes_needed() noexcept {
  return kPairs * sizeof(PlacementPair) + kCacheLine;
}

void PlacementBuilder::add(const PlacementPair& pair) noexcept {
  if (last_world_) {
    const double step = (pair.p_world_left - *last_world_).norm();
    if (step < kLeastStep) return;
    driven_ += step;
  }
  last_world_ = pair.p_world_left;
  if (driven_ >= next_pair_at_) {
    if (!pairs_.push(pair))
      pairs_.back() = pair;  // full: the newest is the farthest, it holds the heading best
    next_pair_at_ = driven_ + options_.placement_m / static_cast<double>(kPairs);
  }
  if (driven_ < options_.placement_m) return;
  fit();
  if (status_ != PlacementStatus::ok) restart();  // a path that holds no heading: the next one may
}

void PlacementBuilder::restart() noexcept {
  collecting_ = true;
  pairs_.clear();
  last_world_.reset();
  driven_ = 0;
  next_pair_at_ = 0;
}

void PlacementBuilder::finish() noexcept {
  if (placement_.revision == 0 && !pairs_.empty()) fit();
}

void PlacementBuilder::fit() noexcept {
  status_ = fit_placement(pairs_.span(), Duration::seconds(options_.correlation_s), &placement_);
  if (status_ != PlacementStatus::ok) return;
  placement_.distance = driven_;
  collecting_ = false;
}

}  // namespace vergence
