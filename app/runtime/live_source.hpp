#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/runtime/clock_record.hpp"
#include "app/runtime/wake_event.hpp"
#include "core/memory/ring.hpp"
#include "drivers/camera.hpp"
#include "drivers/ins.hpp"
#include "drivers/sync/rig_synchronizer.hpp"
#include "drivers/sync/sync_out_pulses.hpp"
#include "drivers/trigger.hpp"

namespace vergence::app {

/// What the devices bring, in one order. A value: goes through a ring.
struct LiveItem {
  enum class Kind : std::uint8_t {
    images,
    reading,
    device_gone,  // a camera
    device_back,
    board_gone,
    board_back,
    board_rebooted,
    acquiring,  // of a camera's frames nothing proves any more which pulses they are of
    proven,     // now something does
    refused,    // internal: a slot on its way back; next() does not give it out
  } kind = Kind::images;
  Stamp stamp{};
  SyncedSet set{};       // images: release() it
  InsSample sample{};    // reading
  InsQuality quality{};  // reading
  int camera = 0;        // device_…, acquiring, proven
  double seconds = 0;    // proven: since the first frame that was not
};

/// Counters of a drive; each written by one thread, exact after stop().
struct LiveCounters {
  SyncCounters sync{};
  std::uint64_t torn = 0;                          // frames refused because parts were missing
  std::uint64_t dropped_sets = 0;                  // live: older images that a newer one overtook
  std::uint64_t dropped_readings = 0;              // live: INS readings that found the ring full
  std::uint64_t clock_resets = 0;                  // device clocks that were found set
  std::uint64_t pulses = 0;                        // the board, or the INS's SyncOut, reported
  std::uint64_t reboots = 0;                       // of the board
  std::uint64_t pauses = 0;                        // of the pulses, to prove the pairing
  std::uint64_t pauses_refused = 0;                // the board cannot
  std::array<ClockRecord, kMaxCameras> cameras{};  // their clocks
  ClockRecord ins{}, board{};
  std::array<bool, kMaxCameras> proven{};  // at the end
  std::size_t ring_high_water = 0;
  std::int64_t worst_stamp_error_ns = 0;  // of the images' stamps, after the first second
};

/// Cameras, INS and board into one stream of rig frames and INS samples on the host's clock.
///
/// The drivers' threads ring a bell; one thread here takes what they have in the order of arrival,
/// maps the stamps, pairs the images and puts both into a ring for the estimator's thread. Merged
/// by arrival: a mock in virtual time gives the same stream on every run.
/// Pulses     Their reports go into the synchroniser in the order of arrival among the frames; what
///            the driver has not mapped is mapped
/// here,
///            with a new fit for every boot. A pause that the synchroniser wants is asked for when
///            a report is taken: in virtual time always at the same one. With `ins_syncout` the
///            INS's readings tell of the pulses; where a gap is wanted its stream is stopped for as
///            long, as camera 0's is with `master_strobe`.
/// Ownership  Devices are configured and outlive it. Slots of a set are the consumer's until
///            release(). All slots go back to their cameras on the consumer's thread.
/// Threads    next(), release(): one consumer, which may be sealed. stop(): any. The rest: the
///            owner.
/// Full       wait_when_full (virtual time): the devices wait. Else the consumer skips to the
///            newest images, readings that find the ring
/// full
///            are dropped; counted.
/// Errors     start() throws InputError naming the device. A device that goes is told by an item
///            and asked again every second.
class LiveSource final : private Notifier {
 public:
  struct Options {
    SyncOptions sync{};
    bool wait_when_full = false;
    Stamp tie_stamp{};     // this stamp …
    HostStamp tie_host{};  // … was this time of the host's clock
    Duration stamp_grid =
        Duration::nanoseconds(1);  // stamps are whole multiples of it, rounded to the nearest; > 0
    /// The board lives in a virtual time of its own, beside the other devices: its next report is
    /// there for the waiting.
    bool board_keeps_own_time = false;
    std::uint32_t sync_out_divider =
        0;  // ins_syncout: readings a pulse, where the INS does not mark those that one left with
  };

  /// `ins` may be null. The cameras in the order of the rig, camera 0 first.
  LiveSource(std::vector<CameraDevice*> cameras, InsDevice* ins, TriggerDevice* trigger,
             const Options& options);
  ~LiveSource();

  /// Who waits for pulses first, who makes them last: the board, the INS with `ins_syncout`, camera
  /// 0 with `master_strobe`.
  void start();
  /// False: the drive is over, or stop() was called.
  [[nodiscard]] bool next(LiveItem* item) noexcept;
  void release(const SyncedSet& set) noexcept;
  [[nodiscard]] ImageView image(const SyncedSet& set, int camera) const noexcept {
    const auto k = static_cast<std::size_t>(camera);
    return set.present[k] ? cameras_[k]->view(set.slots[k]) : ImageView{};
  }
  /// Ends the stream: next() gives what is in the ring, then false.
  void stop() noexcept;
  /// Waits for the thread, stops the devices. After it the counters are exact.
  void join() noexcept;

  [[nodiscard]] const LiveCounters& counters() const noexcept { return counters_; }
  /// Cameras that were gone at the end.
  [[nodiscard]] const std::vector<int>& missing() const noexcept { return missing_; }

 private:
  template <class T>
  struct Head {
    bool held = false, event = false;  // event: the device has gone
    bool gone = false, back = false, ended = false;
    std::int64_t asked_ns = 0;  // when it was last asked to come back
    T value{};
  };
  static constexpr std::size_t kRing = 256;
  // Live: sets that may wait for the estimator before the oldest is skipped; when an image was lost
  // so many come at once.
  static constexpr int kMostWaiting = static_cast<int>(RigSynchronizer::kOpen);

  void notify() noexcept override { bell_.ring(); }
  void work();
  void look(std::size_t k);
  void look_ins();
  void look_board();
  /// Which device's oldest item arrived first: a camera, or after those the INS, the board. −1:
  /// none.
  [[nodiscard]] int earliest() const;
  [[nodiscard]] int ins_place() const noexcept { return static_cast<int>(heads_.size()); }
  void take_frame(std::size_t k);
  void take_reading();
  void take_board();
  void take_pulse(const Pulse& pulse);
  /// Makes the gap that the synchroniser wants.
  void pause_pulses();
  /// Tells of cameras whose pairing was proven, or is not any more.
  void note_proofs(HostStamp now);
  void hand_out_sets();
  void push(const LiveItem& item);
  [[nodiscard]] Stamp stamp_of(HostStamp host) const noexcept;

  std::vector<CameraDevice*> cameras_;
  InsDevice* ins_;
  TriggerDevice* trigger_;
  Options options_;
  RigSynchronizer sync_;
  std::vector<ClockMapper> clocks_;
  std::array<Duration, kMaxCameras>
      exposures_{};  // of the first frames: what the mappers' least delays hold for
  std::vector<Head<Frame>> heads_;
  std::unique_ptr<ClockMapper> ins_clock_;
  Head<InsReading> ins_head_;
  std::unique_ptr<ClockMapper> board_clock_;
  Head<Pulse> board_head_;
  std::optional<SyncOutPulses> sync_out_;
  bool any_pulse_ = false;
  std::uint32_t boot_ = 0;  // of the newest pulse
  struct Proof {
    bool any = false;  // a frame has come since it was started
    bool proven = true;
    HostStamp since{};  // of the first frame without
  };
  std::array<Proof, kMaxCameras> proofs_{};

  Ring<LiveItem, kRing> ring_;
  std::atomic<int> waiting_{0};  // sets in the ring
  WakeEvent bell_, filled_, freed_;
  std::atomic<bool> stop_{false}, finished_{false};
  std::atomic<std::uint64_t> skipped_{0};
  LiveCounters counters_{};
  std::vector<int> missing_;
  std::thread thread_;
};

}  // namespace vergence::app
