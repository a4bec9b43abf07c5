#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/memory/arena.hpp"

namespace vergence::calibration {

/// Makes MonitorFrames out of what a tracker has in hand: the observations of this frame and the
/// camera's motion since the last. Remembers the observations of one earlier frame; when the camera
/// has moved far enough, or the tracks get fewer, those still alive become motion tracks and this
/// frame becomes the earlier one, so that no stretch of a track is used twice.
///
/// Memory   From the arena; observations beyond `capacity` are left out of the motion tracks.
/// Threads  One caller.
class MotionTrackBuilder {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  MotionTrackBuilder(std::size_t capacity, Arena& arena);

  /// Frames in order. The views in the answer live until the next call, `stereo` as long as the
  /// caller's. Sets stereo, found_stereo, motion, the three transforms and moving; expected_stereo
  /// is the caller's to set.
  [[nodiscard]] MonitorFrame next(Stamp stamp, std::uint64_t frame,
                                  std::span<const StereoObservation> stereo,
                                  const Transform& T_now_previous) noexcept;

  /// Forgets the earlier frame: the scene was lost, or the right camera's calibration has changed.
  void reset() noexcept;

 private:
  struct Parts;
  Parts* parts_;  // in the arena
};

}  // namespace vergence::calibration
