#include "core/calibration/track_log.hpp"

#include <algorithm>

namespace vergence::calibration {

TrackLog::TrackLog(std::size_t frames, std::size_t observations, Arena& arena)
    : frames_(arena.make<LoggedFrame>(frames, "logged frames")),
      observations_(arena.make<LoggedObservation>(frames * observations, "logged tracks")),
      capacity_(observations) {}

void TrackLog::begin(const LoggedFrame& frame) noexcept {
  if (size_ == frames_.size())
    first_ = (first_ + 1) % frames_.size();
  else
    ++size_;
  const std::size_t at = slot(size_ - 1);
  frames_[at] = frame;
  frames_[at].observations = observations_.subspan(at * capacity_, 0);
}

void TrackLog::push(const LoggedObservation& observation) noexcept {
  const std::size_t at = slot(size_ - 1);
  std::span<LoggedObservation>& held = frames_[at].observations;
  if (held.size() == capacity_) return;
  held = observations_.subspan(at * capacity_, held.size() + 1);
  held.back() = observation;
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

void TrackLog::copy(const TrackLog& from) noexcept {
  clear();
  first_ = 0;
  const std::size_t n = std::min(from.size(), frames_.size());
  for (std::size_t i = from.size() - n; i < from.size(); ++i) append(from.frame(i));
}

void TrackLog::append(const LoggedFrame& frame) noexcept {
  begin(frame);
  const std::size_t at = slot(size_ - 1), count = std::min(frame.observations.size(), capacity_);
  frames_[at].observations = observations_.subspan(at * capacity_, count);
  std::copy_n(frame.observations.begin(), count, frames_[at].observations.begin());
}

}  // namespace vergence::calibration
