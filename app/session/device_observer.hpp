#pragma once
#include <cstdint>
#include <span>

#include "core/types/time.hpp"
#include "drivers/camera.hpp"
#include "drivers/trigger.hpp"

namespace vergence::app {

/// What the devices of a live session gave, before anything was made of it. Stamps are those of the
/// arrival, on the session's clock.
///
/// Threads  on_device_frame(), on_pulse(): the acquisition's. on_ins_bytes(), on_board_bytes():
/// that
///          device's. They do not wait.
class DeviceObserver {
 public:
  virtual ~DeviceObserver() = default;
  virtual void on_device_frame(Stamp arrival, int camera, const Frame& frame) noexcept = 0;
  virtual void on_pulse(Stamp arrival, const Pulse& pulse) noexcept = 0;
  virtual void on_ins_bytes(Stamp arrival, std::span<const std::uint8_t> bytes) noexcept = 0;
  virtual void on_board_bytes(Stamp arrival, std::span<const std::uint8_t> bytes) noexcept = 0;
};

}  // namespace vergence::app
