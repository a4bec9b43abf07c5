#pragma once
#include <atomic>
#include <span>
#include <utility>

#include "app/session/ins_file.hpp"
#include "app/session/records.hpp"
#include "core/calibration/track_log.hpp"
#include "core/comparison/enu_alignment.hpp"

namespace vergence::app {

/// Same instant on both clocks, which maps stamps of a live session to this machine's clock.
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
  /// First stamp of the run.
  Stamp first{};
  /// Number of frames of the run; 0 if unknown.
  std::uint64_t frames = 0;
  /// Empty in a replay and in virtual time.
  std::optional<ClockTie> tie{};
  /// Bytes of one frame of the largest camera.
  std::size_t image_bytes = 0;
  /// True if SessionRequests::recalibrate has an effect.
  bool can_recalibrate = false;
  /// True if a drive.mcap is written.
  bool recording = false;
};

/// Requests of viewers to a running session, which act at the next frame. Any thread sets them, the
/// estimator's reads them. Must outlive the session.
struct SessionRequests {
  /// Requests a new calibration.
  std::atomic<bool> recalibrate{false};
  /// Writes an event `mark` to events.jsonl.
  std::atomic<bool> mark{false};
  /// Ends drive.mcap; the run continues.
  std::atomic<bool> stop_recording{false};
};

/// Interface of everything attached to a session, live or replayed: recording, live page, pose
/// stream. Set by SessionOptions::observers.
///
/// Ownership  Arguments are references to values of fixed size that the observer copies if needed.
///            Images of a frame are views of driver memory, valid only until on_frame() returns. An
///            observer must outlive the session.
/// Threads    Calls come from the estimator's thread, one at a time. It is sealed: an observer must
///            not allocate, take a lock held by a slow thread, do I/O or wait. Slow work goes
///            through a ring to the observer's own thread; losses by a full ring are counted by the
///            observer. Events before the first and after the last frame come from the caller's
///            thread, while the estimator's does not run.
/// Order      on_frame(), on_pose() of the same frame, then its events and calibrations;
///            on_report() of a frame once its INS samples have arrived, in order of frames. Equal
///            for live and replayed sessions.
/// Errors     No call throws. Observers do not affect poses or files.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;

  /// Called before the session begins, on the caller's thread, which is not sealed.
  virtual void on_start(const SessionStart& /*start*/) noexcept {}

  /// Called with the estimator's next input: images, stamp and pairing.
  virtual void on_frame(const RigFrame& /*frame*/) noexcept {}
  /// Called immediately with the pose of that frame; the report lacks the comparison with the INS.
  virtual void on_pose(const FrameReport& /*report*/) noexcept {}
  /// Called after on_pose() with the newest moving frames and their tracks, valid until it returns.
  /// Empty if the calibration is not monitored.
  virtual void on_tracks(const calibration::TrackLog& /*tracks*/) noexcept {}
  /// Called when the odometry's world was aligned with ENU; `origin` is the origin of ENU. Applies
  /// from the next pose on.
  virtual void on_enu_alignment(const EnuAlignment& /*alignment*/,
                                const Geodetic& /*origin*/) noexcept {}
  /// Called with the complete report of a frame: pose, also in ENU once aligned, and the comparison
  /// with the INS. Without an INS it follows on_pose() immediately, otherwise the samples around
  /// the frame.
  virtual void on_report(const FrameReport& /*report*/) noexcept {}
  /// Called with an INS sample stamped on the session's clock, in order of arrival.
  virtual void on_reading(const InsRecord& /*reading*/) noexcept {}
  /// Called with a line of events.jsonl.
  virtual void on_event(const EventRecord& /*event*/) noexcept {}
  /// Called with an accepted, rejected or initial calibration.
  virtual void on_calibration(const CalibrationRecord& /*calibration*/) noexcept {}

  /// Counters for the block `devices` of summary.json. Called once on the caller's thread, after
  /// the last frame.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> counters() { return {}; }
};

/// Forwards everything to all observers of a session, in their order. They must outlive the last
/// call. Threads as in SessionObserver.
class SessionOutput {
 public:
  SessionOutput() = default;
  explicit SessionOutput(std::span<SessionObserver* const> observers) noexcept
      : observers_(observers) {}

  /// Calls a method of every observer, as in post(&SessionObserver::on_frame, frame).
  template <class Call, class... Values>
  void post(Call call, const Values&... values) noexcept {
    for (SessionObserver* o : observers_) (o->*call)(values...);
  }

 private:
  std::span<SessionObserver* const> observers_{};
};

}  // namespace vergence::app
