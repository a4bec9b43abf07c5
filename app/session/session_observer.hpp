#pragma once
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/session/ins_file.hpp"
#include "app/session/records.hpp"
#include "core/calibration/track_log.hpp"
#include "core/comparison/enu_alignment.hpp"
#include "core/types/calibration.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// One moment on both clocks: how stamps of a live session follow from this machine's clock.
struct ClockTie {
  Stamp stamp{};
  HostStamp host{};

  [[nodiscard]] Stamp stamp_at(HostStamp t) const noexcept { return stamp + (t - host); }
};

/// Properties of a session before its first frame.
struct SessionStart {
  /// Name of the session directory.
  std::string name{};
  /// Camera names of the calibration, each once.
  std::vector<std::string> camera_names{};
  /// First stamp of the drive.
  Stamp first{};
  /// Number of frames of the drive; 0 if unknown.
  std::uint64_t frames = 0;
  /// None in a replay and in virtual time.
  std::optional<ClockTie> tie{};
  /// Bytes of one frame of the largest camera.
  std::size_t image_bytes = 0;
  /// True if SessionRequests::recalibrate has an effect.
  bool can_recalibrate = false;
  /// True if a drive.mcap is written.
  bool recording = false;
};

/// Requests of viewers to a running session. They act at the next frame.
///
/// Threads  Any sets, the estimator's takes. Outlives the session.
struct SessionRequests {
  /// Requests a new calibration.
  std::atomic<bool> recalibrate{false};
  /// Writes an event `mark` to events.jsonl.
  std::atomic<bool> mark{false};
  /// Ends drive.mcap; the run continues.
  std::atomic<bool> stop_recording{false};
};

/// Interface of everything that is attached to a session, live or replayed: recording, live page,
/// pose stream. RunRequest::observers and ReplayRequest::observers take them.
///
/// Ownership  Everything is a reference to a plain value of fixed size that the observer copies if
///            it keeps it. The images of a frame are views of driver memory: valid until
///            on_frame() returns, never after. An observer outlives the session.
/// Threads    The estimator's thread, one call at a time. It is sealed: an observer allocates
///            nothing, takes no lock that a slow thread can hold, does no input or output, and
///            never waits. What takes time goes by a ring to a thread of the observer's own; a full
///            ring is the observer's loss, to be counted by it. Events of before the first frame
///            and after the last come from the caller's thread, while the estimator's does not run.
/// Order      on_frame(), on_pose() of the same frame, then its events and calibrations;
///            on_report() of a frame once its INS readings are there, frames in order.
///            Live and replayed alike.
/// Errors     Nothing throws. What an observer does changes neither poses nor files.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;

  /// The session is about to begin. The caller's thread, not sealed.
  virtual void on_start(const SessionStart& /*start*/) noexcept {}

  /// Called with the estimator's next input: images, stamp, how sure the pairing is.
  virtual void on_frame(const RigFrame& /*frame*/) noexcept {}
  /// Called with the pose of that frame immediately; the report lacks the comparison with the INS.
  virtual void on_pose(const FrameReport& /*report*/) noexcept {}
  /// The newest moving frames with their tracks, after on_pose(); valid until it returns. Empty
  /// where nothing watches the calibration.
  virtual void on_tracks(const calibration::TrackLog& /*tracks*/) noexcept {}
  /// Called when the odometry's world was aligned with ENU; `origin` is the origin of ENU. Applies
  /// from the next pose on.
  virtual void on_enu_alignment(const EnuAlignment& /*alignment*/,
                                const Geodetic& /*origin*/) noexcept {}
  /// Called with the complete report of a frame: its pose, also in ENU once aligned, and the
  /// comparison with the INS. Without an INS it follows on_pose() at once; with one it waits for
  /// the readings around the frame.
  virtual void on_report(const FrameReport& /*report*/) noexcept {}
  /// A reading of the INS, stamped on the session's clock; in order of arrival.
  virtual void on_reading(const InsRecord& /*reading*/) noexcept {}
  /// A line of events.jsonl.
  virtual void on_event(const EventRecord& /*event*/) noexcept {}
  /// A calibration that was accepted or rejected, or that the session begins with.
  virtual void on_calibration(const CalibrationRecord& /*calibration*/) noexcept {}

  /// For summary.json, block `devices`. The caller's thread, once, after the last frame.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> counters() { return {}; }
};

/// Forwards everything to all observers of a session, in their order.
///
/// Ownership  Observers outlive the last call. Threads: as SessionObserver. Memory: none.
class SessionOutput {
 public:
  SessionOutput() = default;
  explicit SessionOutput(std::span<SessionObserver* const> observers) noexcept
      : observers_(observers) {}

  /// Calls a function of every observer, such as &SessionObserver::on_pose.
  template <class Call, class... Values>
  void notify(Call call, const Values&... values) noexcept {
    for (SessionObserver* o : observers_) (o->*call)(values...);
  }

 private:
  std::span<SessionObserver* const> observers_{};
};

}  // namespace vergence::app
