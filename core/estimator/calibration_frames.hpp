#pragma once
#include "core/calibration/options.hpp"
#include "core/calibration/track_log.hpp"
#include "core/odometry/odometry.hpp"

namespace vergence {

/// The frames that the next calibration is solved from: the log of their tracks, which frames go
/// into it, and how many there have to be before the next solve.
///
/// A segment is what one calibration after the other is solved from, while it grows;
/// begin_segment() closes it. `wanted` counts frames taken since the segment began, and those it
/// began with.
///
/// Threads one. Memory from the arena at construction.
class CalibrationFrames {
 public:
  CalibrationFrames(const calibration::CalibrationOptions& options, std::size_t tracks,
                    Arena& arena);
  [[nodiscard]] static std::size_t memory_needed(const calibration::CalibrationOptions& options,
                                                 std::size_t tracks) noexcept;

  /// What a posed frame saw goes into the log, if the rig has moved since the last one that did.
  void take(odometry::Odometry& odometry, const odometry::FrameOutcome& outcome,
            const RigFrame& frame) noexcept;
  /// No frame was taken for so long that the rig must be standing.
  [[nodiscard]] bool standing() const noexcept;
  void restart_standing() noexcept { frames_still_ = 0; }

  /// Another segment of the frames from `number` on; older ones are forgotten.
  void begin_segment(std::uint64_t number) noexcept;
  void begin_segment() noexcept;
  /// The same segment without its frames before `number`.
  void drop_before(std::uint64_t number) noexcept { log_.drop_before(number); }
  /// And without any.
  void clear() noexcept;

  /// Enough for the next solve.
  [[nodiscard]] bool enough() const noexcept;
  /// Enough for a solve at all.
  [[nodiscard]] bool enough_for_any() const noexcept;
  /// There are new ones since solve_begun(), worth another solve.
  [[nodiscard]] bool new_since_solve() const noexcept;
  void solve_begun() noexcept { solved_frames_ = log_.size(); }
  /// Of the segment, in the newest solve.
  [[nodiscard]] std::size_t solved_frames() const noexcept { return solved_frames_; }

  /// The next solve needs this many frames of the segment, and kNewFrames new ones at least.
  void want(std::size_t frames) noexcept;
  /// The next solve needs so many frames beside those the log has lost.
  void want_new(std::size_t frames) noexcept { wanted_ = logged_ - log_.size() + frames; }
  /// One solve after the other while the segment grows.
  void want_more() noexcept;
  void want_full() noexcept { wanted_ = most(); }
  [[nodiscard]] std::size_t most() const noexcept;
  /// Of the first solve of a calibration that is sought.
  [[nodiscard]] std::size_t least() const noexcept;
  /// Of any solve: what a calibration that is given is confirmed with.
  [[nodiscard]] std::size_t fewest() const noexcept;

  [[nodiscard]] const calibration::TrackLog& log() const noexcept { return log_; }

 private:
  const calibration::CalibrationOptions& options_;
  calibration::TrackLog log_;
  std::size_t logged_ = 0, wanted_ = 0;
  std::size_t solved_frames_ = 0;
  int frames_still_ = 0;  // since one was taken
};

}  // namespace vergence
