#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/memory/arena.hpp"

namespace vergence::calibration {

/// Which images of two cameras are of one instant, of those of successive frames (METHOD §7.3): the
/// left one and the camera's, the left one of the frame before and the camera's (the camera is a
/// frame late), or the other way round.
///
/// Of the right pairing the points' distances from the epipolar lines are as wide as they usually
/// are, w. With widths a of this frame's pairs and b of the shifted ones a point's log-likelihood
/// ratio of the shifted pairing is ln(a / w) − (b²/w² − 1)/2: positive where the shifted pairs are
/// usual and this frame's are not, negative after a knock, when neither are, and zero for a rig
/// that stands. With a and b exchanged it is that of this frame's pairing against the shifted one.
/// Sums that never fall below zero are Page's test (E. S. Page, Biometrika 41, 1954).
///
/// Memory   From the arena; points beyond `capacity` are left out.
/// Threads  One caller. Time: linear but for a sort of the points.
class PairingEvidence {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  PairingEvidence(std::size_t capacity, Arena& arena);

  /// Frames in order, each with the points that both cameras show, which are put in order of their
  /// tracks. X_k = T_camera_left X_left. Only successive frames, by their numbers, are compared.
  void next(std::uint64_t frame, std::span<StereoObservation> points,
            const Transform& T_camera_left, const Pinhole& left, const Pinhole& camera) noexcept;
  /// Median distance of the newest frame's points from their epipolar lines, px; 0 without any.
  [[nodiscard]] double distance_px() const noexcept { return distance_px_; }
  /// In frames: 1: the camera is late, −1: the left one is; 0: nothing is known of a lag.
  [[nodiscard]] int lag_frames() const noexcept;
  /// A frame or two speak for a lag: what else they seem to say is not to be relied on.
  [[nodiscard]] bool suspected() const noexcept;
  /// An image came twice: a camera may be a frame late from now on.
  void question() noexcept {
    questioned_ = true;
    in_step_[0] = in_step_[1] = 0;
  }
  /// From question() until motion shows that the cameras are in step.
  [[nodiscard]] bool questioned() const noexcept { return questioned_; }
  /// Since the last lag or question(), motion shows that the cameras are in step.
  [[nodiscard]] bool cameras_in_sync() const noexcept;
  /// The scene was lost.
  void reset() noexcept {
    count_ = 0;
    usual_px_ = 0;
    shifted_ = in_step_ = {};
  }

 private:
  std::span<StereoObservation> before_;  // in order of their tracks
  std::size_t count_ = 0;                // of before_
  std::span<float> now_, late_px_, early_px_;
  std::uint64_t frame_ = 0;  // of before_
  double distance_px_ = 0, usual_px_ = 0;
  bool questioned_ = false;
  // Log-likelihood ratios, not below zero: that the camera is late, or the left one, against in
  // step, and the other way round.
  std::array<double, 2> shifted_{}, in_step_{};
};

}  // namespace vergence::calibration
