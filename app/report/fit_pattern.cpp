#include "app/report/fit_pattern.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::app::report {
namespace {

constexpr double kFewestMatches = 150;  // of either part of the image
constexpr double kEdge = 0.9;           // px
constexpr double kGrowth = 1.3;         // edge over middle
constexpr double kScatter = 0.4;  // px: a turn between the cameras moves near and far points alike
                                  // and leaves the images' noise

struct Sum {
  double matches = 0, means = 0, scatters = 0;  // squares, weighted by matches

  void add(const ResidualRow& r) {
    matches += r.matches;
    means += r.matches * r.mean_px * r.mean_px;
    scatters += r.matches * r.scatter_px * r.scatter_px;
  }
  [[nodiscard]] double rms() const { return matches > 0 ? std::sqrt(means / matches) : 0; }
};

}  // namespace

Fit fit_of(const Session& session, bool at_the_end) {
  const auto requested = [at_the_end](const ResidualRow& r) {
    return r.camera == 1 && r.at_the_end == at_the_end && r.matches > 0;
  };
  double width = 0, height = 0;
  for (const ResidualRow& r : session.residuals)
    width = std::max(width, r.left + r.width), height = std::max(height, r.top + r.height);
  Sum middle, edge;
  for (const ResidualRow& r : session.residuals) {
    if (!requested(r)) continue;
    const double from_centre =
        std::hypot(r.left + (r.width - width) / 2, r.top + (r.height - height) / 2);
    (from_centre < std::hypot(width, height) / 4 ? middle : edge).add(r);
  }
  Fit fit;
  fit.middle_px = middle.rms(), fit.edge_px = edge.rms();
  if (middle.matches < kFewestMatches || edge.matches < kFewestMatches) return fit;
  fit.scatter_px = std::sqrt((middle.scatters + edge.scatters) / (middle.matches + edge.matches));
  fit.pattern = FitPattern::fine;
  if (fit.edge_px > kEdge && fit.edge_px > kGrowth * fit.middle_px)
    fit.pattern = fit.scatter_px > kScatter ? FitPattern::lens : FitPattern::turned;
  return fit;
}

}  // namespace vergence::app::report
