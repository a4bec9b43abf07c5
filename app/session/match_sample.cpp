#include "app/session/match_sample.hpp"

#include <algorithm>

namespace vergence::app {

void MatchSample::take(const calibration::TrackLog& log) noexcept {
  if (log.empty()) return;
  const calibration::LoggedFrame& frame = log.frame(log.size() - 1);
  if (any_ && frame.number <= newest_) return;
  newest_ = frame.number;
  any_ = true;
  for (const calibration::LoggedObservation& s : frame.observations)
    for (int k = 1; s.by(0) && k < kMaxCameras; ++k) {
      if (!s.by(k)) continue;
      const auto &left = s.raw[0], &other = s.raw[static_cast<std::size_t>(k)];
      push({{left.x(), left.y()},
            {other.x(), other.y()},
            frame.number,
            static_cast<std::uint8_t>(k)});
    }
}

void MatchSample::push(const RawMatch& match) noexcept {
  if (seen_++ % step_ != 0) return;
  if (size_ == kMost) {
    // What is kept are the matches 0, step, 2 step …: without every second one they are those of
    // the doubled step.
    for (std::size_t i = 0; i < kMost / 2; ++i) matches_[i] = matches_[2 * i];
    size_ = kMost / 2;
    step_ *= 2;
    if ((seen_ - 1) % step_ != 0) return;
  }
  matches_[size_++] = match;
}

void MatchSample::rig_changed(std::uint64_t frame) noexcept {
  first_change_ = std::min(first_change_, frame);
}

}  // namespace vergence::app
