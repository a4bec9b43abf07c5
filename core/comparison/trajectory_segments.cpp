#include <algorithm>
#include <cassert>

#include "core/comparison/trajectory_metrics.hpp"

namespace vergence {
namespace {

struct Sum {
  std::size_t count = 0;
  double translation = 0, rotation = 0;

  void add(double t, double r) {
    ++count;
    translation += t;
    rotation += r;
  }
  /// Leaves NaN if nothing was added.
  void mean(std::size_t* n, double* t, double* r) const {
    *n = count;
    if (count == 0) return;
    *t = translation / static_cast<double>(count);
    *r = rotation / static_cast<double>(count);
  }
};

Transform relative(const Transform& from, const Transform& to, double scale) {
  Transform T = from.inverse() * to;
  T.t *= scale;
  return T;
}

}  // namespace

SegmentErrors segment_errors(std::span<const StampedPose> estimate,
                             std::span<const StampedPose> reference, const SegmentOptions& options,
                             double estimate_scale) {
  assert(estimate.size() == reference.size() && options.step > 0);
  // Distance along the reference, in m.
  std::vector<double> distance(reference.size(), 0.0);
  for (std::size_t i = 1; i < distance.size(); ++i)
    distance[i] =
        distance[i - 1] + (reference[i].T_world_body.t - reference[i - 1].T_world_body.t).norm();

  SegmentErrors out;
  out.step = options.step;
  Sum all;
  for (const double length : options.lengths) {
    assert(length > 0);
    Sum sum;
    for (std::size_t first = 0; first < distance.size();
         first += static_cast<std::size_t>(options.step)) {
      // As in the devkit, the segment is strictly longer than the nominal length, by which errors
      // are divided.
      const auto end = std::upper_bound(distance.begin() + static_cast<std::ptrdiff_t>(first),
                                        distance.end(), distance[first] + length);
      // Later starts have even less path left.
      if (end == distance.end()) break;
      const auto last = static_cast<std::size_t>(end - distance.begin());
      const Transform R =
          relative(reference[first].T_world_body, reference[last].T_world_body, 1.0);
      const Transform P =
          relative(estimate[first].T_world_body, estimate[last].T_world_body, estimate_scale);
      const Transform E = P.inverse() * R;
      const double translation = E.t.norm() / length, rotation = rotation_angle(E.R) / length;
      sum.add(translation, rotation);
      all.add(translation, rotation);
    }
    LengthError row;
    row.length = length;
    sum.mean(&row.count, &row.translation, &row.rotation);
    out.per_length.push_back(row);
  }
  all.mean(&out.count, &out.translation, &out.rotation);
  return out;
}

}  // namespace vergence
