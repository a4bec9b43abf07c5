#include "app/publish/live_trail.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::app {
namespace {

/// Steps of the map that an extent is worth: fewer would show no way any more.
constexpr float kLeastSteps = 100;

float distance(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

void LiveTrail::add(const Place& place) {
  if (places_.size() == kMost) thin();
  if (places_.empty() || distance(place.world, places_.back().world) >= least_step_m_)
    return places_.push_back(place);
  // A rig that stands for weeks uses up no places, whatever its status does.
  Place& last = places_.back();
  if (place.status <= last.status) return;
  last.status = place.status;
  shown_ = std::min(shown_, places_.size() - 1);
}

void LiveTrail::thin() {
  shown_ = 0;
  while (places_.size() > kMost / 2) {
    if (2 * least_step_m_ * kLeastSteps > extent()) {
      // Round and round a yard: what was driven first lies under what came later.
      places_.erase(places_.begin(), places_.begin() + kMost / 2);
      return;
    }
    least_step_m_ *= 2;
    drop_near();
  }
}

void LiveTrail::drop_near() {
  std::size_t kept = 0;
  for (std::size_t i = 1; i < places_.size(); ++i) {
    if (distance(places_[i].world, places_[kept].world) >= least_step_m_)
      places_[++kept] = places_[i];
    else
      places_[kept].status = std::max(places_[kept].status, places_[i].status);
  }
  places_.resize(kept + 1);
}

float LiveTrail::extent() const {
  float longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(
        places_.begin(), places_.end(),
        [axis](const Place& a, const Place& b) { return a.world[axis] < b.world[axis]; });
    longest = std::max(longest, most->world[axis] - least->world[axis]);
  }
  return longest;
}

}  // namespace vergence::app
