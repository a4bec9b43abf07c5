#include "app/checkerboard/view_collector.hpp"

#include <algorithm>
#include <limits>

namespace vergence::app {
namespace {

/// Mean distance of common corners; infinite if none.
double mean_distance(const BoardCorners& a, const BoardCorners& b) {
  double sum = 0;
  int n = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (i->index == j->index) {
      sum += (i->pixel - j->pixel).norm();
      ++n, ++i, ++j;
    } else if (i->index < j->index) {
      ++i;
    } else {
      ++j;
    }
  }
  return n == 0 ? std::numeric_limits<double>::infinity() : sum / n;
}

}  // namespace

ViewCollector::ViewCollector(Coverage coverage, double image_width_px)
    : coverage_(std::move(coverage)),
      still_px_(kStillOfWidth * image_width_px),
      elsewhere_px_(kElsewhereOfWidth * image_width_px) {}

bool ViewCollector::still(const BoardView& seen) const {
  for (std::size_t k = 0; k < seen.corners.size(); ++k) {
    if (seen.corners[k].empty()) continue;
    if (mean_distance(last_.corners[k], seen.corners[k]) > still_px_) return false;
  }
  return true;
}

bool ViewCollector::elsewhere(const BoardView& seen) const {
  return std::ranges::all_of(views_, [&](const BoardView& v) {
    return mean_distance(v.corners[0], seen.corners[0]) > elsewhere_px_;
  });
}

OfferResult ViewCollector::offer(const BoardView& seen) {
  const auto others = std::count_if(seen.corners.begin() + 1, seen.corners.end(),
                                    [](const auto& c) { return !c.empty(); });
  const bool held = still(seen);
  last_ = seen;
  if (seen.corners[0].empty() || others == 0) return OfferResult::not_seen;
  if (!held) return OfferResult::moving;
  if (!coverage_.brings_something(seen) && !(coverage_.views() < kEnoughViews && elsewhere(seen)))
    return OfferResult::nothing_new;
  coverage_.add(seen);
  views_.push_back(seen);
  return OfferResult::accepted;
}

}  // namespace vergence::app
