#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/fixed_vector.hpp"

namespace vergence::calibration {

/// Tests which images of two cameras are from the same instant: those of one frame, or the previous
/// left image and the camera's (the camera is a frame late), or the other way round (the left
/// camera is late).
///
/// In the true pairing the points' distances from the epipolar lines have their usual spread w.
/// With median distances a in this frame's pairing and b in the shifted one, a point's
/// log-likelihood ratio for the shifted pairing is ln(a / w) − (b²/w² − 1)/2: positive if only the
/// shifted distances are usual, negative after a knock, zero at standstill. Exchanging a and b
/// gives the ratio for this frame's pairing. Sums that never fall below zero are Page's test (E. S.
/// Page, Biometrika 41, 1954).
///
/// Memory   From the arena; points beyond `capacity` are left out.
/// Threads  One caller. Time: linear, except for sorting the points.
class PairingEvidence {
 public:
  PairingEvidence() = default;
  PairingEvidence(std::size_t capacity, Arena& arena);

  /// Processes the next frame with the points that both cameras show, and sorts these by track.
  /// Only frames with consecutive numbers are compared.
  void next(std::uint64_t frame, std::span<StereoObservation> points,
            const StereoPair& pair) noexcept;
  /// Median distance of the newest frame's points from their epipolar lines, in px; 0 without
  /// points.
  [[nodiscard]] double distance_px() const noexcept { return distance_px_; }
  /// Lag in frames: 1 if the camera is late, −1 if the left one is, 0 if no lag is detected.
  [[nodiscard]] int lag_frames() const noexcept {
    if (lag_margin() < 1) return 0;
    return shifted_[0] > shifted_[1] ? 1 : -1;
  }
  /// Evidence for a lag over the evidence that decides.
  [[nodiscard]] double lag_margin() const noexcept {
    return std::max(shifted_[0], shifted_[1]) / kDecided;
  }
  /// True if one or two frames indicate a lag, so other conclusions from them are unreliable.
  [[nodiscard]] bool suspected() const noexcept {
    return std::max(shifted_[0], shifted_[1]) >= 0.5 * kPointsOfAFrame;
  }
  /// Call when an image was repeated: a camera may be a frame late from now on.
  void question() noexcept {
    questioned_ = true;
    in_step_[0] = in_step_[1] = 0;
  }
  /// True from question() until motion shows that the cameras are in sync.
  [[nodiscard]] bool questioned() const noexcept { return questioned_; }
  /// True if motion since the last lag or question() has shown that the cameras are in sync.
  [[nodiscard]] bool cameras_in_sync() const noexcept {
    return std::min(in_step_[0], in_step_[1]) >= kDecided;
  }
  /// Call when the map was lost: clears all evidence.
  void reset() noexcept {
    before_.clear();
    usual_px_ = 0;
    shifted_ = in_step_ = {};
  }

 private:
  // Number of independent points that a frame counts for, because its errors share causes (rolling
  // shutter, a lens). Each counts at most one log-likelihood.
  static constexpr double kPointsOfAFrame = 5;
  // Threshold for one wrong decision in a million (Wald 1945); takes at least three frames.
  static constexpr double kDecided = 13.8;

  // Points of the previous frame, sorted by track.
  BoundedVector<StereoObservation> before_;
  std::span<float> now_, late_px_, early_px_;
  std::uint64_t frame_ = 0;
  double distance_px_ = 0, usual_px_ = 0;
  bool questioned_ = false;
  // Log-likelihood ratios, at least zero, for and against a shifted pairing: [0] the camera is
  // late, [1] the left one is.
  std::array<double, 2> shifted_{}, in_step_{};
};

}  // namespace vergence::calibration
