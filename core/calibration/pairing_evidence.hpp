#pragma once
#include <cstddef>
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
/// that stands. Sums that never fall below zero are Page's test (E. S. Page, Biometrika 41, 1954).
///
/// Memory   From the arena; points beyond `capacity` are left out.
/// Threads  One caller. Time: linear but for a sort of the points.
class PairingEvidence {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  PairingEvidence(std::size_t capacity, Arena& arena);

  /// Frames in order, each with the points that both cameras show, which are put in order of their
  /// tracks. X_k = T_camera_left X_left.
  void next(std::span<StereoObservation> points, const Transform& T_camera_left,
            const Pinhole& left, const Pinhole& camera) noexcept;
  /// Median distance of the newest frame's points from their epipolar lines, px; 0 without any.
  [[nodiscard]] double distance_px() const noexcept { return distance_px_; }
  /// In frames: 1: the camera is late, −1: the left one is; 0: nothing is known of a lag.
  [[nodiscard]] int lag_frames() const noexcept;
  /// A frame or two speak for a lag: what else they seem to say is not to be relied on.
  [[nodiscard]] bool suspected() const noexcept;
  /// The scene was lost.
  void reset() noexcept {
    count_ = 0;
    late_ = early_ = usual_px_ = 0;
  }

 private:
  std::span<StereoObservation> before_;  // in order of their tracks
  std::size_t count_ = 0;                // of before_
  std::span<float> now_, late_px_, early_px_;
  double distance_px_ = 0, usual_px_ = 0;
  double late_ = 0, early_ = 0;  // log-likelihood ratios, not below zero
};

}  // namespace vergence::calibration
