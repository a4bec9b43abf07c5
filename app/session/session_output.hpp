#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/recorder/recorder.hpp"
#include "app/session/session_observer.hpp"

namespace vergence::app {

/// Where all that a session has to say goes: the recorder, and every observer.
///
/// Ownership  Recorder and observers outlive the last call. Threads: as SessionObserver.
/// Memory     None of its own.
class SessionOutput {
 public:
  SessionOutput() = default;
  SessionOutput(Recorder* recorder, std::span<SessionObserver* const> observers) noexcept
      : recorder_(recorder), observers_(observers) {}

  void post(const RigFrame& frame) noexcept {
    for (SessionObserver* o : observers_) o->on_frame(frame);
  }
  void post(const PoseSample& sample) noexcept {
    for (SessionObserver* o : observers_) o->on_pose(sample);
  }
  void post(const calibration::TrackLog& tracks) noexcept {
    for (SessionObserver* o : observers_) o->on_tracks(tracks);
  }
  void post(const Placement& placement, const Geodetic& origin) noexcept {
    for (SessionObserver* o : observers_) o->on_placement(placement, origin);
  }
  void post(const PoseRecord& pose) noexcept {
    recorder_->post(Record(pose));
    for (SessionObserver* o : observers_) o->on_compared(pose);
  }
  void post(const EventRecord& event) noexcept {
    recorder_->post(Record(event));
    for (SessionObserver* o : observers_) o->on_event(event);
  }
  void post(const CalibrationRecord& calibration) noexcept {
    recorder_->post(calibration);
    for (SessionObserver* o : observers_) o->on_calibration(calibration);
  }
  /// Precondition: Recorder::Options::ins.
  void post(const InsRecord& reading) noexcept {
    recorder_->post(reading);
    for (SessionObserver* o : observers_) o->on_reading(reading);
  }
  [[nodiscard]] std::vector<std::string> take_errors() { return recorder_->take_errors(); }

 private:
  Recorder* recorder_ = nullptr;
  std::span<SessionObserver* const> observers_{};
};

}  // namespace vergence::app
