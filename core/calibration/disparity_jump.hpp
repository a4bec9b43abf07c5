#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/calibration/monitor.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/fixed_vector.hpp"

namespace vergence::calibration {

/// Change of one frame's disparities against their prediction from the previous frame.
struct DisparityJump {
  /// False if there are too few tracks.
  bool measured = false;
  // Change common to all tracks, along the epipolar lines; with `confirmed`, that of the onset
  // frame.
  double px = 0;
  /// Standard deviation, from the scatter of the tracks.
  double sigma_px = 0;
  /// The change over the smallest one that is suspected; 0 until the usual scatter is known.
  double over_limit = 0;
  /// True if the change exceeds the usual scatter; the next frame decides.
  bool suspected = false;
  /// True if the change did not revert: the rig has changed.
  bool confirmed = false;
  /// With `confirmed`, the first frame of the changed rig.
  std::uint64_t onset_frame = 0;
};

/// Detects a sudden rotation of a camera about the axis that epipolar lines do not show (yaw, for
/// cameras side by side): it shifts all disparities equally from one frame to the next.
///
/// A track's point is triangulated in the previous frame, moved by the left camera's motion and
/// projected again. The residual disparity is fitted robustly by a shift and by an error of the
/// motion along the optical axis, proportional to d/Z. A constant calibration error also has
/// residuals proportional to d/Z, which the fit absorbs, so the test works before the calibration
/// is known. On recorded sequences 95 % of the shifts are below 0.26 px, the largest is 0.68 px and
/// reverts (build/bench/margin_bench); 0.1° shift KITTI's disparities by 1.25 px. The
/// shift of a single distorted image reverts in the next frame.
///
/// Memory   From the arena; tracks beyond `capacity` are left out.
/// Threads  One caller. Time: linear, except for sorting the tracks.
class DisparityJumpDetector {
 public:
  DisparityJumpDetector() = default;
  DisparityJumpDetector(std::size_t capacity, Arena& arena);

  /// Sets the calibration in use, and clears the previous frame.
  void set_reference(const StereoPair& pair) noexcept {
    pair_ = pair;
    reset();
  }
  /// Changes to another calibration of the same rig and another map; `stereo`, points of the new
  /// map, replace the previous frame. A suspected shift still waits for the next frame.
  void rebase(const StereoPair& pair, std::span<const StereoObservation> stereo) noexcept;
  /// Changes the transform and keeps the previous frame: for a refined calibration, and for every
  /// frame while the cameras are not linked.
  void set_transform(const Transform& T_camera_left) noexcept {
    pair_.T_camera_left = T_camera_left;
  }
  /// Call when the map was lost: the next frame is not compared with earlier ones.
  void reset() noexcept {
    before_.clear();
    pending_.reset();
    T_now_before_ = {};
    skipped_ = 0;
  }

  /// Processes the next frame, with the motion of the left camera since the previous one.
  [[nodiscard]] DisparityJump next(std::uint64_t frame, std::span<const StereoObservation> stereo,
                                   const Transform& T_now_previous) noexcept;
  /// Call instead of next() if one of the two cameras showed nothing: the next frame is compared
  /// with the last processed one. After too many skipped frames no comparison is possible, and a
  /// suspected shift counts as a change.
  void skip(const Transform& T_now_previous) noexcept;

 private:
  struct Row {
    // Measured minus predicted disparity, in px.
    double e = 0;
    // Derivative of `e` with respect to an error of the motion along the optical axis, in px/m.
    double along = 0;
  };
  /// Adds the row of a track; a track that measures nothing has none.
  void add_row(const StereoObservation& before, const StereoObservation& now,
               const Transform& T_now_previous) noexcept;
  [[nodiscard]] DisparityJump fit() noexcept;
  void evaluate(std::uint64_t frame, DisparityJump* jump) noexcept;

  /// A shift that waits for the next frame.
  struct Pending {
    std::uint64_t frame = 0;
    double px = 0, sigma_px = 0;
    // Number of frames since then without a measurement.
    int unmeasured = 0;
  };

  StereoPair pair_{};
  // Observations, sorted by track.
  BoundedVector<StereoObservation> before_, now_;
  BoundedVector<Row> rows_;
  std::span<double> scratch_;
  // Motion over the frames skipped since before_.
  Transform T_now_before_{};
  int skipped_ = 0;
  std::optional<Pending> pending_;
  // Number of measured frames, at most kScatterFrames.
  int measured_ = 0;
  // Mean square of the shifts that were no jump, in px².
  double mean_square_ = 0;
};

}  // namespace vergence::calibration
