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

/// Counters of a drive; each written by one thread, exact after join().
struct AcquisitionCounters {
  SyncCounters sync{};
  /// Incomplete frames, which were refused.
  std::uint64_t torn = 0;
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

/// Cameras, INS and board into one stream of rig frames, INS samples and device events, stamped on
/// the host's clock tied to Unix time.
///
/// The drivers' threads ring a bell; one thread here takes what they have in the order of arrival,
/// maps the stamps, pairs the images and puts everything into a ring for the consumer's thread.
/// Merged by arrival: a mock in virtual time gives the same stream on every run.
/// Pulses     Their reports go into the synchroniser in the order of arrival among the frames; what
///            the driver has not mapped is mapped here, with a new fit for every boot. A pause that
///            the synchroniser requires is asked for when a report is taken: in virtual time always
///            at the same one. With `ins_syncout` the INS's readings report the pulses; where a gap
///            is wanted its stream is stopped for as long, as camera 0's is with `master_strobe`.
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
/// Ownership  Devices are configured and outlive it. Slots of a frame are the consumer's until
///            release(). All slots go back to their cameras on the consumer's thread.
/// Threads    next(), release(): one consumer, which may be sealed. stop(): any. The rest: the
///            owner.
/// Full       wait_when_full (virtual time): the devices wait. Else the consumer skips to the
///            newest images, readings that find the ring full are dropped; counted.
/// Errors     start() returns the device that failed; std::system_error where no thread can be had.
///            A device that goes later is an event, and is asked again every second.
class Acquisition final : private Notifier {
 public:
  struct Options {
    SyncOptions sync{};
    bool wait_when_full = false;
    Stamp tie_stamp{};     // this stamp …
    HostStamp tie_host{};  // … was this time of the host's clock
    Duration stamp_grid =
        Duration::nanoseconds(1);  // stamps are whole multiples of it, rounded to the nearest; > 0
    FrameObserver* frame_observer = nullptr;  // null: frames are not observed
    PulseObserver* pulse_observer = nullptr;  // set by start(); null: pulses are not recorded
  };

  /// `ins` may be null. The cameras in the order of the rig, camera 0 first.
  Acquisition(std::vector<CameraDevice*> cameras, InsDevice* ins, TriggerDevice* trigger,
              const Options& options);
  ~Acquisition();

  /// Order of starting: waiting for pulses first, making them last: the board, the INS with
  /// `ins_syncout`, camera 0 with `master_strobe`. → the device that could not be started; the
  /// stream has not begun then. `observer`: receives the pulses, outlives the acquisition; may be
  /// null.
  [[nodiscard]] std::optional<StartFailure> start(PulseObserver* observer = nullptr);
  /// False: the drive is over, or stop() was called.
  [[nodiscard]] bool next(Acquired* item) noexcept { return queue_.next(item); }
  /// Call once for every AcquiredFrame that next() returned.
  void release(const AcquiredFrame& frame) noexcept { queue_.release(frame.set); }
  /// Devices that are gone are asked to come back at every poll, a second apart at least, and a
  /// poll follows on whatever a device brings. Called where time passes while no device brings
  /// anything: some times a second.
  void wake() noexcept { notify(); }
  /// Number of iterations of its thread: it stands still while a device holds that up. Any thread.
  [[nodiscard]] std::uint64_t rounds() const noexcept {
    return rounds_.load(std::memory_order_relaxed);
  }
  /// Ends the stream: next() gives what is in the ring, then false.
  void stop() noexcept;
  /// Waits for the thread, stops the devices. After it the counters are exact.
  void join() noexcept;

  [[nodiscard]] const AcquisitionCounters& counters() const noexcept { return counters_; }
  /// Cameras that were gone at the end.
  [[nodiscard]] const std::vector<int>& missing() const noexcept { return missing_; }

 private:
  void notify() noexcept override { wake_.signal(); }
  void work();
  void poll();
  void poll_ins();
  /// Which device's oldest item arrived first: a camera, or after those the INS, the board. −1:
  /// none.
  [[nodiscard]] int earliest() const;
  [[nodiscard]] int ins_place() const noexcept { return static_cast<int>(heads_.size()); }
  void push_frame(std::size_t k);
  void push_reading();
  void poll_board();
  void push_pulse(const Pulse& pulse);
  /// Makes the gap that the synchroniser requires.
  void pause_pulses();
  /// Cameras that have given nothing for ten seconds of pulses hang, whatever their drivers know:
  /// they are stopped, and asked to come back like any that is gone.
  void give_up_mute_cameras(HostStamp now);
  void record_disconnect(int camera, HostStamp when);
  /// Tells of cameras whose pairing was verified, or is not any more.
  void record_proofs(HostStamp now);
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
