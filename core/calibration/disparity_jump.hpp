#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/memory/arena.hpp"

namespace vergence::calibration {

/// Change of the disparities of one frame against their prediction from the frame before.
struct DisparityJump {
  bool measured = false;  // false: too few tracks
  // Common to all tracks, along the epipolar lines; with `confirmed`, that of the onset frame.
  double px = 0;
  double sigma_px = 0;  // from the tracks' own scatter
  int tracks = 0;
  bool suspected =
      false;  // larger than chance and this drive's own scatter; the next frame decides
  bool confirmed = false;         // it did not go back: the rig has changed
  std::uint64_t onset_frame = 0;  // with `confirmed`: the first frame of the changed rig
};

/// Detects a sudden turn of a camera about the axis that epipolar lines do not show (yaw, for
/// cameras side by side): it moves all disparities alike from one frame to the next.
///
/// A track's point is triangulated in the frame before, moved by the left camera's motion and
/// projected again. What is left of its disparity is fitted, robustly, by a shift and by an error
/// of the motion along the optical axis, which moves disparities as d/Z. A calibration that is
/// wrong but does not change leaves errors that go with d/Z, which the fit takes out, so that the
/// test holds while the calibration is not known yet. On recorded drives 95 % of the shifts are
/// under 0.26 px, the largest is 0.68 px and goes back (build/bench/calibration_bench jumps); a
/// turn of 0.1° moves KITTI's disparities by 1.25 px. An image that is spoilt for one frame goes
/// back in the next, and is no change.
///
/// Memory   From the arena; tracks beyond `capacity` are left out.
/// Threads  One caller. Time: linear but for a sort of the tracks.
class DisparityJumpDetector {
 public:
  [[nodiscard]] static std::size_t memory_needed(std::size_t capacity) noexcept;
  DisparityJumpDetector(std::size_t capacity, Arena& arena);

  /// Sets the transform and pinholes in use, and clears the frame before.
  void set_reference(const Transform& T_camera_left, const Pinhole& left,
                     const Pinhole& camera) noexcept;
  /// Changes to another calibration of the same rig and to another scene; `stereo`, points of the
  /// new scene, take the place of the frame before. A suspected shift still waits for the next
  /// frame.
  void rebase(const Transform& T_camera_left, const Pinhole& left, const Pinhole& camera,
              std::span<const StereoObservation> stereo) noexcept;
  /// Changes the transform and keeps the frame before: for a refined calibration, and for every
  /// frame while the cameras are not linked.
  void set_transform(const Transform& T_camera_left) noexcept { T_camera_left_ = T_camera_left; }
  /// Call when the scene was lost: the next frame is compared with none.
  void reset() noexcept {
    count_ = 0;
    pending_ = Pending{};
    T_now_before_ = {};
    skipped_ = 0;
  }

  /// Frames in order, each with the motion of the left camera since the one before.
  [[nodiscard]] DisparityJump next(std::uint64_t frame, std::span<const StereoObservation> stereo,
                                   const Transform& T_now_previous) noexcept;
  /// Call instead of next() for a frame in which one of the two cameras showed nothing: the next
  /// frame is compared with the one before it. If too many are skipped there is nothing to compare
  /// with, and a suspected shift counts as a change.
  void skip(const Transform& T_now_previous) noexcept;

 private:
  struct Row {
    double e = 0;      // px, disparity found minus predicted
    double along = 0;  // px/m: what an error of the motion along the optical axis does to it
  };
  [[nodiscard]] bool row(const StereoObservation& before, const StereoObservation& now,
                         const Transform& T_now_previous, Row* out) const noexcept;
  [[nodiscard]] DisparityJump fit(std::span<Row> rows) noexcept;
  /// Sorted by track; how many.
  std::size_t take(std::span<const StereoObservation> stereo,
                   std::span<StereoObservation> into) noexcept;
  void evaluate(std::uint64_t frame, DisparityJump* jump) noexcept;

  /// A shift that waits for the next frame.
  struct Pending {
    bool any = false;
    std::uint64_t frame = 0;
    double px = 0, sigma_px = 0;
    int unmeasured = 0;  // frames since then that said nothing
  };

  Transform T_camera_left_{};
  Pinhole left_{}, camera_{};
  std::span<StereoObservation> before_, now_;  // sorted by track
  std::span<Row> rows_;
  std::span<double> scratch_;
  std::size_t count_ = 0;     // of before_
  Transform T_now_before_{};  // over the frames skipped since then
  int skipped_ = 0;
  Pending pending_{};
  int measured_ = 0;        // frames, up to kScatterFrames
  double mean_square_ = 0;  // px², of the shifts that were no jump
};

}  // namespace vergence::calibration
