#pragma once
#include <algorithm>
#include <vector>

#include "drivers/acquisition/acquired.hpp"

/// Helpers to query an acquisition's stream.
namespace vergence::test {

[[nodiscard]] inline const AcquiredFrame* frame_of(const Acquired& item) {
  return std::get_if<AcquiredFrame>(&item);
}
[[nodiscard]] inline const InsRecord* reading_of(const Acquired& item) {
  return std::get_if<InsRecord>(&item);
}
[[nodiscard]] inline const DeviceEvent* event_of(const Acquired& item) {
  return std::get_if<DeviceEvent>(&item);
}

template <class Kind>
[[nodiscard]] int count(const std::vector<Acquired>& items) {
  return static_cast<int>(std::count_if(items.begin(), items.end(), [](const Acquired& item) {
    return std::holds_alternative<Kind>(item);
  }));
}
[[nodiscard]] inline int count(const std::vector<Acquired>& items, DeviceEvent::Kind kind) {
  return static_cast<int>(std::count_if(items.begin(), items.end(), [kind](const Acquired& item) {
    return event_of(item) != nullptr && event_of(item)->kind == kind;
  }));
}

/// The longest that a camera's pairing went without proof, s.
[[nodiscard]] inline double worst_acquisition(const std::vector<Acquired>& items) {
  double worst = 0;
  for (const Acquired& item : items)
    if (event_of(item) != nullptr && event_of(item)->kind == DeviceEvent::Kind::pairing_verified)
      worst = std::max(worst, event_of(item)->seconds);
  return worst;
}

/// Compares items and times: of frames the same images of the same pulse, of readings the
/// same count, of events the same kind.
[[nodiscard]] inline bool same(const Acquired& a, const Acquired& b) {
  if (a.index() != b.index() || stamp_of(a) != stamp_of(b)) return false;
  if (frame_of(a) != nullptr)
    return frame_of(a)->set.number == frame_of(b)->set.number &&
           frame_of(a)->set.present == frame_of(b)->set.present;
  if (reading_of(a) != nullptr) return reading_of(a)->sample.number == reading_of(b)->sample.number;
  return event_of(a)->kind == event_of(b)->kind;
}

}  // namespace vergence::test
