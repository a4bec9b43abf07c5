#pragma once
#include "core/calibration/options.hpp"
#include "core/calibration/track_log.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {

/// The frames that the next calibration is solved from: the log of their tracks, which frames go
/// into it, and how many there have to be before the next solve.
///
/// A segment is what one calibration after the other is solved from, while it grows;
/// begin_segment() closes it. The number of frames wanted counts those that the segment began with,
/// too.
///
/// Threads one. Memory from the arena at construction.
class CalibrationFrames {
 public:
  CalibrationFrames(const calibration::CalibrationOptions& options, std::size_t tracks,
                    Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(const calibration::CalibrationOptions& options,
                                                 std::size_t tracks) noexcept;

  /// Logs the tracks of a posed frame if the image has moved by a pixel on average since the last
  /// frame logged, and every camera gave a good image.
  void take(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome,
            const RigFrame& frame) noexcept;
  /// True if no frame was logged for so long that the rig must be standing.
  [[nodiscard]] bool standing() const noexcept;
  void restart_standing() noexcept { frames_still_ = 0; }

  /// Begins another segment with the logged frames from `number` on; older ones are dropped.
  void begin_segment(std::uint64_t number) noexcept;
  void begin_segment() noexcept;
  /// Drops the segment's frames before `number`; the segment goes on.
  void drop_before(std::uint64_t number) noexcept { log_.drop_before(number); }
  /// Drops all frames and begins another segment.
  void clear() noexcept;

  /// True if there are frames enough for the next solve.
  [[nodiscard]] bool enough() const noexcept;
  /// True if there are frames enough for any solve.
  [[nodiscard]] bool enough_for_any() const noexcept;
  /// True if enough frames were logged since solve_begun() to make another solve worthwhile.
  [[nodiscard]] bool new_since_solve() const noexcept;
  void solve_begun() noexcept { solved_frames_ = log_.size(); }
  /// Number of the segment's frames in the newest solve.
  [[nodiscard]] std::size_t solved_frames() const noexcept { return solved_frames_; }

  /// Makes the next solve wait for this many frames of the segment, and for kNewFrames new ones at
  /// least.
  void want(std::size_t frames) noexcept;
  /// Makes the next solve wait until the log holds `frames` frames.
  void want_new(std::size_t frames) noexcept { wanted_ = logged_ - log_.size() + frames; }
  /// Makes the next solve wait for least() frames more than the newest solve had, or for a full
  /// segment.
  void want_more() noexcept;
  void want_full() noexcept { wanted_ = most(); }
  [[nodiscard]] std::size_t most() const noexcept;
  /// Minimum number of frames of the first solve of an estimation.
  [[nodiscard]] std::size_t least() const noexcept;
  /// Minimum number of frames of any solve; enough to confirm a calibration that was given.
  [[nodiscard]] std::size_t min_to_solve() const noexcept;

  [[nodiscard]] const calibration::TrackLog& log() const noexcept { return log_; }

 private:
  const calibration::CalibrationOptions& options_;
  calibration::TrackLog log_;
  std::size_t logged_ = 0, wanted_ = 0;
  std::size_t solved_frames_ = 0;
  int frames_still_ = 0;  // since one was taken
};

}  // namespace vergence
