#pragma once
#include <algorithm>

#include "core/calibration/options.hpp"
#include "core/calibration/track_log.hpp"
#include "core/math/robust.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {

/// Collects the frames for the next calibration: logs their tracks, selects frames, and determines
/// when there are enough for a solve.
///
/// A segment is the growing set of frames that successive solves use; begin_segment() starts
/// another one. Frames carried over from the previous segment count towards the number required.
///
/// Not thread-safe. Memory from the arena at construction.
class CalibrationFrames {
 public:
  CalibrationFrames(const calibration::CalibrationOptions& options, std::size_t tracks,
                    Arena& arena);

  /// Logs the tracks of a posed frame if every camera gave a good image and the tracks have moved
  /// by at least a pixel on average since the last logged frame.
  void add(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome,
           const RigFrame& frame) noexcept;
  /// Returns true if this segment logged no frame for so long that the rig must be standing still.
  [[nodiscard]] bool standing() const noexcept { return frames_still_ > options_.min_frames; }

  /// Begins another segment with the logged frames from `number` on; drops older ones.
  void begin_segment(std::uint64_t number = 0) noexcept;
  /// Drops the segment's frames before `number`; the segment continues.
  void drop_before(std::uint64_t number) noexcept { log_.drop_before(number); }
  /// Drops all frames and begins another segment.
  void clear() noexcept;

  /// True if there are enough frames for the next solve.
  [[nodiscard]] bool enough() const noexcept { return logged_ >= required_ && enough_for_any(); }
  /// True if there are enough frames for any solve.
  [[nodiscard]] bool enough_for_any() const noexcept { return log_.size() >= min_to_solve(); }
  /// True if enough frames were logged since solve_begun() to make another solve worthwhile.
  [[nodiscard]] bool new_since_solve() const noexcept {
    return log_.size() >= solved_frames_ + kMinForMean;
  }
  void solve_begun() noexcept { solved_frames_ = log_.size(); }
  /// Number of the segment's frames in the newest solve.
  [[nodiscard]] std::size_t solved_frames() const noexcept { return solved_frames_; }

  /// Makes the next solve wait for this many frames of the segment, and for at least kMinForMean
  /// new ones.
  void require(std::size_t frames) noexcept;
  /// Makes the next solve wait until the log holds `frames` frames.
  void require_logged(std::size_t frames) noexcept { required_ = logged_ - log_.size() + frames; }
  /// Capacity of the log, and number of frames of a full segment.
  [[nodiscard]] std::size_t max_frames() const noexcept {
    return static_cast<std::size_t>(options_.max_frames);
  }
  /// Minimum number of frames of the first solve of an estimation.
  [[nodiscard]] std::size_t min_frames() const noexcept {
    return static_cast<std::size_t>(options_.min_frames);
  }
  /// Minimum number of frames of any solve: together with the held-out frames this makes
  /// min_frames, so a supplied calibration is evaluated as early as possible.
  [[nodiscard]] std::size_t min_to_solve() const noexcept {
    return min_frames() - std::min<std::size_t>(min_frames(), kMinForMean);
  }

  [[nodiscard]] const calibration::TrackLog& log() const noexcept { return log_; }

 private:
  const calibration::CalibrationOptions& options_;
  calibration::TrackLog log_;
  std::size_t logged_ = 0, required_ = 0;
  std::size_t solved_frames_ = 0;
  // Number of frames since one was logged, or since the segment began.
  int frames_still_ = 0;
};

}  // namespace vergence
