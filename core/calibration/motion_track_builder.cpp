#include "core/calibration/motion_track_builder.hpp"

#include <algorithm>
#include <bit>

namespace vergence::calibration {
namespace {

constexpr double kTravel =
    3.0;  // m since the earlier frame that make a look: what a street's depths want
constexpr double kLeastTravel = 0.3;  // m under which a pair of frames says nothing of yaw
constexpr double kSurvivors =
    0.4;  // of the earlier frame's tracks: fewer, and there is no use in waiting
constexpr double kMovingSpeed = 0.5;  // m/s: slower, and neighbouring images are nearly the same
constexpr std::size_t kProbes = 16;   // of the table, at most half full

}  // namespace

struct MotionTrackBuilder::Parts {
  struct Slot {
    StereoObservation observation;
    bool used = false;
  };
  std::span<Slot> slots;
  std::span<MotionTrack> motion;
  std::size_t capacity = 0;
  bool has_earlier = false, has_stamp = false;
  std::size_t stored = 0;
  Stamp last{};
  std::uint64_t earlier = 0;  // frame
  Transform T_now_earlier{}, T_earlier_previous{};
  double travelled = 0;

  [[nodiscard]] Slot* at(std::uint32_t track, std::size_t probe) noexcept {
    return &slots[(static_cast<std::size_t>(track) * 2654435761U + probe) & (slots.size() - 1)];
  }
  [[nodiscard]] const StereoObservation* find(std::uint32_t track) noexcept {
    for (std::size_t i = 0; i < kProbes; ++i) {
      const Slot* s = at(track, i);
      if (!s->used) return nullptr;
      if (s->observation.track == track) return &s->observation;
    }
    return nullptr;
  }
  void remember(std::uint64_t frame, std::span<const StereoObservation> stereo,
                const Transform& T_now_previous) noexcept {
    earlier = frame;
    for (Slot& s : slots) s.used = false;
    stored = 0;
    for (const StereoObservation& observation : stereo.first(std::min(stereo.size(), capacity))) {
      for (std::size_t i = 0; i < kProbes; ++i) {
        Slot* s = at(observation.track, i);
        if (s->used) continue;
        *s = Slot{observation, true};
        ++stored;
        break;
      }
    }
    T_now_earlier = Transform{};
    T_earlier_previous = T_now_previous;
    travelled = 0;
    has_earlier = true;
  }
};

std::size_t MotionTrackBuilder::memory_needed(std::size_t capacity) noexcept {
  return sizeof(Parts) +
         std::bit_ceil(2 * std::max<std::size_t>(capacity, 1)) * sizeof(Parts::Slot) +
         capacity * sizeof(MotionTrack) + 3 * kCacheLine;
}

MotionTrackBuilder::MotionTrackBuilder(std::size_t capacity, Arena& arena)
    : parts_(arena.make<Parts>(1, "motion tracks: state").data()) {
  parts_->capacity = capacity;
  parts_->slots = arena.make<Parts::Slot>(std::bit_ceil(2 * std::max<std::size_t>(capacity, 1)),
                                          "motion tracks: observations");
  parts_->motion = arena.make<MotionTrack>(capacity, "motion tracks");
}

void MotionTrackBuilder::reset() noexcept { parts_->has_earlier = parts_->has_stamp = false; }

MonitorFrame MotionTrackBuilder::next(Stamp stamp, std::uint64_t frame,
                                      std::span<const StereoObservation> stereo,
                                      const Transform& T_now_previous) noexcept {
  Parts& p = *parts_;
  MonitorFrame out;
  out.stamp = stamp;
  out.frame = frame;
  out.stereo = stereo;
  out.found_stereo = static_cast<int>(stereo.size());
  out.T_now_previous = T_now_previous;
  const double step = T_now_previous.t.norm(),
               seconds = p.has_stamp ? (stamp - p.last).to_seconds() : 0;
  out.moving = seconds > 0 && step > kMovingSpeed * seconds;
  p.last = stamp;
  p.has_stamp = true;
  if (!p.has_earlier) {
    p.remember(frame, stereo, T_now_previous);
    return out;
  }
  p.T_now_earlier = T_now_previous * p.T_now_earlier;
  p.travelled += step;
  std::size_t n = 0;
  for (const StereoObservation& s : stereo) {
    if (n == p.motion.size()) break;
    const StereoObservation* before = p.find(s.track);
    if (before == nullptr) continue;
    p.motion[n++] = {
        before->left, before->right, s.left, s.right, std::max(before->sigma_px, s.sigma_px),
        s.track};
  }
  const bool few = static_cast<double>(n) < kSurvivors * static_cast<double>(p.stored);
  if (!few && p.travelled < kTravel) return out;
  if (p.travelled >= kLeastTravel) {
    out.motion = p.motion.first(n);
    out.before = p.earlier;
    out.T_now_before = p.T_now_earlier;
    out.T_before_earlier = p.T_earlier_previous;
  }
  p.remember(frame, stereo, T_now_previous);
  return out;
}

}  // namespace vergence::calibration
