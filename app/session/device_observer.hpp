#pragma once
#include <cstdint>

#include "app/recording/device_records.hpp"
#include "core/types/time.hpp"
#include "drivers/camera.hpp"
#include "drivers/trigger.hpp"

namespace vergence::app {

/// What the devices of a live session gave, before anything was made of it. Stamps are host times
/// on the session's clock, most of them of an arrival.
///
/// Threads  on_device_frame(), on_pulse(), on_device_gone(): the acquisition's. on_line_event():
///          that device's, or the owner's before the start. on_set(): the estimator's. They do not
///          wait.
class DeviceObserver {
 public:
  virtual ~DeviceObserver() = default;
  virtual void on_device_frame(Stamp arrival, int camera, const Frame& frame) noexcept = 0;
  /// `edge`: where the driver itself maps the pulse to (pulse.mapped).
  virtual void on_pulse(Stamp arrival, const Pulse& pulse, Stamp edge) noexcept = 0;
  /// `camera`: AcquisitionObserver::kTrigger for the board.
  virtual void on_device_gone(Stamp when, int camera) noexcept = 0;
  virtual void on_line_event(Stamp when, DeviceLine line, const LineEvent& event) noexcept = 0;
  /// Of the next frame.
  virtual void on_set(const SetArrivals& set) noexcept = 0;
};

}  // namespace vergence::app
