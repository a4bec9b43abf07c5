#include "core/comparison/enu_alignment_builder.hpp"

#include "core/comparison/comparison.hpp"

namespace vergence {
namespace {

// Minimum step in metres; smaller ones are noise at standstill.
constexpr double kMinStep = 0.05;

}  // namespace

EnuAlignmentBuilder::EnuAlignmentBuilder(const ComparisonOptions& options, Arena& arena)
    : options_(options), pairs_(arena.make<EnuAlignmentPair>(kPairs, "comparison: alignment")) {}

void EnuAlignmentBuilder::add(const EnuAlignmentPair& pair) noexcept {
  if (last_world_) {
    const double step = (pair.p_world_left - *last_world_).norm();
    if (step < kMinStep) return;
    driven_ += step;
  }
  last_world_ = pair.p_world_left;
  if (driven_ >= next_pair_at_) {
    // If full, keep the newest, which is farthest away and best determines the heading.
    if (!pairs_.push(pair)) pairs_.back() = pair;
    next_pair_at_ = driven_ + options_.alignment_distance_m / static_cast<double>(kPairs);
  }
  if (driven_ < options_.alignment_distance_m) return;
  fit();
  // The path does not determine a heading; try the next one.
  if (status_ != EnuAlignmentStatus::ok) restart();
}

void EnuAlignmentBuilder::restart() noexcept {
  collecting_ = true;
  pairs_.clear();
  last_world_.reset();
  driven_ = 0;
  next_pair_at_ = 0;
}

void EnuAlignmentBuilder::finish() noexcept {
  if (alignment_.revision == 0 && !pairs_.empty()) fit();
}

void EnuAlignmentBuilder::fit() noexcept {
  status_ =
      fit_enu_alignment(pairs_.span(), Duration::seconds(options_.correlation_s), &alignment_);
  if (status_ != EnuAlignmentStatus::ok) return;
  alignment_.distance = driven_;
  collecting_ = false;
}

}  // namespace vergence
