#include "core/calibration/track_log.hpp"

#include <algorithm>

namespace vergence::calibration {

std::size_t TrackLog::memory_needed(std::size_t frames, std::size_t sightings) noexcept {
  return frames * (sizeof(LoggedFrame) + sightings * sizeof(LoggedSighting)) + 2 * kCacheLine;
}

TrackLog::TrackLog(std::size_t frames, std::size_t sightings, Arena& arena)
    : frames_(arena.make<LoggedFrame>(frames, "logged frames")),
      sightings_(arena.make<LoggedSighting>(frames * sightings, "logged tracks")),
      capacity_(sightings) {}

void TrackLog::begin(const LoggedFrame& frame) noexcept {
  if (size_ == frames_.size())
    first_ = (first_ + 1) % frames_.size();
  else
    ++size_;
  const std::size_t at = slot(size_ - 1);
  frames_[at] = frame;
  frames_[at].sightings = sightings_.subspan(at * capacity_, 0);
}

void TrackLog::push(const LoggedSighting& sighting) noexcept {
  const std::size_t at = slot(size_ - 1);
  std::span<LoggedSighting>& held = frames_[at].sightings;
  if (held.size() == capacity_) {
    ++left_out_;
    return;
  }
  held = sightings_.subspan(at * capacity_, held.size() + 1);
  held.back() = sighting;
}

void TrackLog::drop_before(std::uint64_t number) noexcept {
  while (size_ > 0 && frames_[first_].number < number) {
    first_ = (first_ + 1) % frames_.size();
    --size_;
  }
}

void TrackLog::scale_about(const Vec3& centre, double factor) noexcept {
  for (std::size_t i = 0; i < size_; ++i) {
    LoggedFrame& f = frame(i);
    f.T_left_world = scaled_about(f.T_left_world, centre, factor);
    if (f.unlinked)
      for (Transform& T : f.T_camera_left) T.t *= factor;
  }
}

void TrackLog::copy(const TrackLog& from, std::size_t frames) noexcept {
  clear();
  first_ = 0;
  const std::size_t n = std::min({frames, from.size(), frames_.size()});
  for (std::size_t i = from.size() - n; i < from.size(); ++i) append(from.frame(i));
}

void TrackLog::append(const LoggedFrame& frame) noexcept {
  begin(frame);
  const std::size_t at = slot(size_ - 1), count = std::min(frame.sightings.size(), capacity_);
  std::copy_n(frame.sightings.begin(), count,
              sightings_.begin() + static_cast<std::ptrdiff_t>(at * capacity_));
  frames_[at].sightings = sightings_.subspan(at * capacity_, count);
  left_out_ += frame.sightings.size() - count;
}

}  // namespace vergence::calibration
