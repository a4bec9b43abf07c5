#pragma once
#include "app/session/device_observer.hpp"
#include "app/session/session_observer.hpp"
#include "drivers/acquisition/acquired.hpp"
#include "drivers/device.hpp"

namespace vergence::app {

/// Between the drivers' observers and a DeviceObserver: puts host times on the session's clock.
///
/// Ownership  The observer outlives it, it outlives the devices' threads. Threads: as
///            DeviceObserver.
class DeviceTap final : public AcquisitionObserver {
 public:
  DeviceTap(DeviceObserver* observer, const ClockTie& tie) noexcept
      : observer_(observer),
        tie_(tie),
        ins_(this, DeviceLine::ins),
        board_(this, DeviceLine::board) {}
  DeviceTap(const DeviceTap&) = delete;
  DeviceTap& operator=(const DeviceTap&) = delete;

  [[nodiscard]] LineObserver& ins_line() noexcept { return ins_; }
  [[nodiscard]] LineObserver& board_line() noexcept { return board_; }

  void on_device_frame(int camera, const Frame& frame) noexcept override {
    observer_->on_device_frame(tie_.stamp_at(frame.arrival), camera, frame);
  }
  void on_pulse(const Pulse& pulse) noexcept override {
    observer_->on_pulse(tie_.stamp_at(pulse.arrival), pulse, tie_.stamp_at(pulse.host));
  }
  void on_device_gone(int camera, HostStamp when) noexcept override {
    observer_->on_device_gone(tie_.stamp_at(when), camera);
  }
  /// The estimator is about to be given this set. Its thread.
  void on_set(const SyncedSet& set) noexcept {
    SetArrivals arrivals{set.number, {}};
    for (std::size_t k = 0; k < arrivals.at.size(); ++k)
      if (set.present[k]) arrivals.at[k] = tie_.stamp_at(set.arrivals[k]);
    observer_->on_set(arrivals);
  }

 private:
  struct Line final : LineObserver {
    Line(DeviceTap* t, DeviceLine l) noexcept : tap(t), line(l) {}
    void on_line_event(const LineEvent& event) noexcept override {
      tap->observer_->on_line_event(tap->tie_.stamp_at(event.time), line, event);
    }
    DeviceTap* tap;
    DeviceLine line;
  };

  DeviceObserver* observer_;
  ClockTie tie_;
  Line ins_, board_;
};

}  // namespace vergence::app
