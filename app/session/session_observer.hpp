#pragma once
#include "app/recorder/ins_file.hpp"
#include "app/recorder/records.hpp"
#include "core/types/pose_sample.hpp"
#include "core/types/rig_frame.hpp"

namespace vergence::app {

/// Sees what goes through a session, live or replayed: what a recording of images, a live page or a
/// line publisher is attached by. RunRequest::observers and ReplayRequest::observers take them.
///
/// Ownership  Everything is a reference to a plain value of fixed size that the observer copies if
///            it wants to keep it. The images of a frame are views of driver memory: valid until
///            on_frame() returns, never after. An observer outlives the session.
/// Threads    The estimator's thread, one call at a time. It is sealed: an observer allocates
///            nothing, takes no lock that a slow thread can hold, does no input or output, and
///            never waits. What takes time goes by a ring to a thread of the observer's own; a full
///            ring is the observer's loss, to be counted by it. Events of before the first frame
///            and after the last come from the caller's thread, while the estimator's does not run.
/// Order      on_frame(), on_pose() of the same frame, then its events and calibrations;
///            on_compared() of a frame once its INS readings are there, frames in order.
///            Live and replayed alike.
/// Errors     Nothing throws. What an observer does changes neither poses nor files.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;

  /// What the estimator is about to be given: images, stamp, how sure the pairing is.
  virtual void on_frame(const RigFrame& /*frame*/) noexcept {}
  /// What it says of that frame, at once.
  virtual void on_pose(const PoseSample& /*sample*/) noexcept {}
  /// The line of poses.csv: the pose placed on the earth, the INS beside it. Without an INS at
  /// once; with one after the readings around the frame have come.
  virtual void on_compared(const PoseRecord& /*pose*/) noexcept {}
  /// A reading of the INS, stamped on the session's clock; in order of arrival.
  virtual void on_reading(const InsRecord& /*reading*/) noexcept {}
  /// A line of events.jsonl.
  virtual void on_event(const EventRecord& /*event*/) noexcept {}
  /// A calibration that was accepted or rejected, or that the session begins with.
  virtual void on_calibration(const CalibrationRecord& /*calibration*/) noexcept {}
};

}  // namespace vergence::app
