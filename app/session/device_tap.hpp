#pragma once
#include "app/session/device_observer.hpp"
#include "app/session/session_observer.hpp"
#include "drivers/acquisition/acquired.hpp"
#include "drivers/device.hpp"

namespace vergence::app {

/// Between the drivers' observers and a DeviceObserver: puts arrivals on the session's clock.
///
/// Ownership  The observer outlives it, it outlives the devices' threads. Threads: as
///            DeviceObserver.
class DeviceTap final : public AcquisitionObserver {
 public:
  DeviceTap(DeviceObserver* observer, const ClockTie& tie) noexcept
      : observer_(observer), tie_(tie), ins_(this), board_(this) {}
  DeviceTap(const DeviceTap&) = delete;
  DeviceTap& operator=(const DeviceTap&) = delete;

  [[nodiscard]] ByteObserver& ins_line() noexcept { return ins_; }
  [[nodiscard]] ByteObserver& board_line() noexcept { return board_; }

  void on_device_frame(int camera, const Frame& frame) noexcept override {
    observer_->on_device_frame(tie_.stamp_at(frame.arrival), camera, frame);
  }
  void on_pulse(const Pulse& pulse) noexcept override {
    observer_->on_pulse(tie_.stamp_at(pulse.arrival), pulse);
  }

 private:
  struct InsLine final : ByteObserver {
    explicit InsLine(DeviceTap* t) noexcept : tap(t) {}
    void on_bytes(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept override {
      tap->observer_->on_ins_bytes(tap->tie_.stamp_at(arrival), bytes);
    }
    DeviceTap* tap;
  };
  struct BoardLine final : ByteObserver {
    explicit BoardLine(DeviceTap* t) noexcept : tap(t) {}
    void on_bytes(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept override {
      tap->observer_->on_board_bytes(tap->tie_.stamp_at(arrival), bytes);
    }
    DeviceTap* tap;
  };

  DeviceObserver* observer_;
  ClockTie tie_;
  InsLine ins_;
  BoardLine board_;
};

}  // namespace vergence::app
