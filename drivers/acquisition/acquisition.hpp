#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/types/rig_frame.hpp"
#include "drivers/acquisition/acquired.hpp"
#include "drivers/acquisition/acquired_queue.hpp"
#include "drivers/acquisition/clock_record.hpp"
#include "drivers/acquisition/device_head.hpp"
#include "drivers/camera.hpp"
#include "drivers/common/wake_event.hpp"
#include "drivers/ins.hpp"
#include "drivers/sync/rig_synchronizer.hpp"
#include "drivers/sync/sync_out_pulses.hpp"
#include "drivers/trigger.hpp"

namespace vergence {

/// Counters of a run; each is written by one thread and exact after join().
struct AcquisitionCounters {
  SyncCounters sync{};
  /// Incomplete frames, which are not used.
  std::uint64_t incomplete = 0;
  /// Live: older sets that a newer one replaced.
  std::uint64_t dropped_sets = 0;
  /// Live: INS readings dropped because the ring was full.
  std::uint64_t dropped_readings = 0;
  /// Detected steps of device clocks.
  std::uint64_t clock_resets = 0;
  /// Pulses reported by the trigger board or by the INS (SyncOut).
  std::uint64_t pulses = 0;
  /// Restarts of the trigger board.
  std::uint64_t reboots = 0;
  /// Pauses of the pulses to verify the pairing.
  std::uint64_t pauses = 0;
  /// Pauses that the trigger board does not support.
  std::uint64_t pauses_refused = 0;
  /// Clocks of the cameras.
  std::array<ClockRecord, kMaxCameras> cameras{};
  ClockRecord ins{}, board{};
  /// State at the end.
  std::array<bool, kMaxCameras> verified{};
  std::size_t ring_high_water = 0;
  /// Largest stamp error of images after the first second.
  std::int64_t worst_stamp_error_ns = 0;
};

/// A device that could not be started.
struct StartFailure {
  DeviceInfo device{};
  DeviceStatus status = DeviceStatus::ok;
  /// Message of the driver; empty: the status is sufficient.
  std::string message{};
};

/// Merges cameras, INS and trigger board into one stream of rig frames, INS samples and device
/// events, with stamps on the host's clock mapped to Unix time.
///
/// The drivers' threads notify one thread here, which reads their data in order of arrival, maps
/// stamps, pairs images and fills a ring for the consumer's thread. Since the order is that of
/// arrival, a mock in virtual time gives the same stream on every run.
/// Pulses     Reports enter the synchroniser in order of arrival among the frames. Those that the
///            driver has not mapped are mapped here, with a new fit for every boot. A pause
///            required by the synchroniser is requested when a report is read, in virtual time
///            always at the same one. With `ins_syncout` the INS's samples report the pulses. A gap
///            is then made by stopping its stream, or camera 0's with `master_strobe`.
///
///     Acquisition acquisition({&left, &right}, &ins, &board, options);
///     if (const auto failure = acquisition.start()) return;  // failure->device does not start
///     for (Acquired item; acquisition.next(&item);)
///       if (const auto* frame = std::get_if<AcquiredFrame>(&item)) {
///         use(frame->rig);
///         acquisition.release(*frame);
///       }
///     acquisition.join();
///
/// Ownership  Devices are configured and outlive it. Slots of a frame belong to the consumer until
///            release(). Slots return to their cameras on the consumer's thread.
/// Threads    One consumer, which may be sealed, calls next() and release(). stop() is thread-safe.
///            The owner makes the other calls.
/// Full       With wait_when_full (virtual time) the devices wait. Otherwise the consumer skips to
///            the newest images and INS samples are dropped; both are counted.
/// Errors     start() returns the device that failed, or throws std::system_error if there is no
///            thread. A later disconnect is an event, and the device is retried every second.
class Acquisition final : private Notifier {
 public:
  struct Options {
    SyncOptions sync{};
    bool wait_when_full = false;
    /// Unix time and host time of the same instant, which map stamps.
    Stamp tie_stamp{};
    HostStamp tie_host{};
    /// Stamps are rounded to multiples of this duration, > 0.
    Duration stamp_grid = Duration::nanoseconds(1);
    /// Null if frames are not observed.
    FrameObserver* frame_observer = nullptr;
    /// Set by start(); null if pulses are not recorded.
    PulseObserver* pulse_observer = nullptr;
  };

  /// `ins` may be null. Cameras are in the order of the rig.
  Acquisition(std::vector<CameraDevice*> cameras, InsDevice* ins, TriggerDevice* trigger,
              const Options& options);
  ~Acquisition();

  /// Starts the devices that wait for pulses first and those that make them last: the trigger
  /// board, the INS with `ins_syncout`, camera 0 with `master_strobe`. Returns the device that
  /// failed; the stream has then not begun. `observer` receives the pulses and must outlive the
  /// acquisition; may be null.
  [[nodiscard]] std::optional<StartFailure> start(PulseObserver* observer = nullptr);
  /// Returns false once the run is over or stop() was called.
  [[nodiscard]] bool next(Acquired* item) noexcept { return queue_.next(item); }
  /// Call once for every AcquiredFrame that next() returned.
  void release(const AcquiredFrame& frame) noexcept { queue_.release(frame.set); }
  /// Triggers a poll, which retries disconnected devices at most once per second. A poll also
  /// follows any data, so call this some times per second while no device delivers.
  void wake() noexcept { notify(); }
  /// Number of iterations of the thread, constant while a device blocks it. Thread-safe.
  [[nodiscard]] std::uint64_t rounds() const noexcept {
    return rounds_.load(std::memory_order_relaxed);
  }
  /// Ends the stream: next() returns the remaining items, then false.
  void stop() noexcept;
  /// Waits for the thread and stops the devices. The counters are exact afterwards.
  void join() noexcept;

  [[nodiscard]] const AcquisitionCounters& counters() const noexcept { return counters_; }
  /// Cameras that were disconnected at the end.
  [[nodiscard]] const std::vector<int>& missing() const noexcept { return missing_; }

 private:
  void notify() noexcept override { wake_.signal(); }
  void work();
  void poll();
  [[nodiscard]] Reconnect reconnect() const noexcept {
    return options_.wait_when_full ? Reconnect::at_each_poll : Reconnect::paced;
  }
  void poll_ins();
  /// Index of the device whose oldest item arrived first: a camera, then the INS and the trigger
  /// board. −1 if there is none.
  [[nodiscard]] int earliest() const;
  [[nodiscard]] int ins_place() const noexcept { return static_cast<int>(heads_.size()); }
  void push_frame(std::size_t k);
  void push_reading();
  void poll_board();
  void push_pulse(const Pulse& pulse);
  /// Makes the gap required by the synchroniser.
  void pause_pulses();
  /// Stops cameras without a frame during ten seconds of pulses, whatever their drivers report, and
  /// retries them like disconnected ones.
  void stop_silent_cameras(HostStamp now);
  void record_disconnect(int camera, HostStamp when);
  /// Reports cameras whose pairing is newly verified or no longer verified.
  void record_pairing_changes(HostStamp now);
  void hand_out_sets();
  void push_event(DeviceEvent::Kind kind, HostStamp when, int camera = 0, double seconds = 0);
  [[nodiscard]] Stamp stamp_of(HostStamp host) const noexcept;

  std::vector<CameraDevice*> cameras_;
  InsDevice* ins_;
  TriggerDevice* trigger_;
  Options options_;
  RigSynchronizer sync_;
  std::vector<CameraClock> clocks_;
  std::vector<DeviceHead<CameraDevice, Frame>> heads_;
  std::unique_ptr<ClockMapper> ins_clock_;
  DeviceHead<InsDevice, InsReading> ins_head_;
  PulseMapper pulse_mapper_;
  DeviceHead<TriggerDevice, Pulse> board_head_;
  std::optional<SyncOutPulses> sync_out_;
  PairingTracker pairing_;

  AcquiredQueue queue_;
  WakeEvent wake_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> rounds_{0};
  AcquisitionCounters counters_{};
  std::vector<int> missing_;
  std::thread thread_;
};

}  // namespace vergence
