#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/types/time.hpp"
#include "drivers/mock/detail/delivery_queue.hpp"
#include "drivers/mock/detail/devices.hpp"
#include "drivers/mock/detail/pulse_plan.hpp"
#include "drivers/mock/rig_truth.hpp"

namespace vergence::mock {

/// The slots of a pulse plan that a pause leaves out.
///
/// Threads  request(): any. make(): the scheduler's producer, slot after slot. Memory: none.
class PauseWindow {
 public:
  /// So many slots from that one on, in this boot (0: in any); slots that were made already stay.
  void request(std::uint64_t from, std::uint32_t pulses, std::uint32_t boot) noexcept {
    const std::lock_guard lock(mutex_);
    from = std::max(from, made_);
    pause_ = {from, from + pulses, boot};
  }
  /// Slot `slot` is made now, in this boot. True: it is left out.
  [[nodiscard]] bool make(std::uint64_t slot, std::uint32_t boot) noexcept {
    const std::lock_guard lock(mutex_);
    made_ = slot + 1;
    if (!pause_) return false;
    const bool in_boot = pause_->boot == 0 || pause_->boot == boot;
    if (!in_boot || slot >= pause_->end) pause_.reset();
    return pause_ && slot >= pause_->from;
  }

 private:
  struct Pause {
    std::uint64_t from = 0, end = 0;  // slots
    std::uint32_t boot = 0;           // of Pulse
  };
  std::mutex mutex_;
  std::optional<Pause> pause_;
  std::uint64_t made_ = 0;  // slots
};

/// One pulse as a camera's input meets it.
struct PulseAt {
  std::uint64_t number = 0;  // its slot in the plan
  Duration time{};           // of the exposure's start, since the drive's start
  const PulsePlan* plan = nullptr;
};

/// Fate of one camera's image of one pulse under the active faults.
struct Exposure {
  bool missed = false;  // never happens
  bool lost = false;    // never arrives
  bool twice = false;   // arrives again
  Duration delay{};     // of the arrival, beyond the usual
  double brightness = 1;
  // Which image it is: usually this camera's, of this pulse.
  int camera = 0;
  std::uint64_t pulse = 0;  // numbers its noise
  Duration time{};          // of the start of the exposure
};

/// Pure function of its arguments; the draws of faults with a share come from `seed`.
[[nodiscard]] Exposure exposure_of(const RigTruth& truth, std::uint64_t seed, const PulseAt& pulse,
                                   int camera) noexcept;

/// Makes what the devices deliver, pulse after pulse; the DeliveryQueue hands it out.
///
/// Threads  begin(), halt(): the owner's. One thread makes everything, a second one renders every
///          other camera.
/// Time     Virtual: what is made before the next pulse is delivered before it, and the producer
///          waits for room. Real: a pulse that is over before its pictures are begun has none.
/// Pauses   Virtual, with reports_read: slot n is made once every report that arrives before it
///          was taken. Who asks at the report of slot m, before taking the next, finds slot m + 4
///          not made: the report of m + 1 is here within two periods of its pulse.
class Scheduler final : public PulseListener {
 public:
  /// All of it outlives the scheduler; `trigger` is given by attach().
  Scheduler(RigContext* rig, std::vector<std::unique_ptr<MockCamera>>* cameras, MockIns* ins)
      : rig_(*rig), cameras_(*cameras), ins_(*ins) {}
  ~Scheduler() override { halt(); }
  void attach(MockTrigger* trigger) noexcept {
    trigger_ = trigger;
    queue_.attach(trigger);
  }

  void begin(const TriggerConfiguration& c) override;
  void halt() noexcept override;
  void leave_out(std::uint64_t from, std::uint32_t pulses, std::uint32_t boot) noexcept override {
    pauses_.request(from, pulses, boot);
  }
  [[nodiscard]] PulsePlan plan_of(const TriggerConfiguration& c) const;
  /// The host's time at the drive's start.
  [[nodiscard]] HostStamp start() const noexcept { return start_; }
  [[nodiscard]] std::uint64_t pulses(double rate_hz) const noexcept;

 private:
  /// State of a camera in the scheduler.
  struct Sender {
    bool unplugged = false;
    std::uint64_t counter_base = 0;  // of the slot less what the camera counts
  };
  struct Shooting {
    int camera = 0;  // that sends it
    Exposure exposure{};
    FrameSlot slot = 0;
    ExposureSetting setting{};
  };
  static constexpr HostStamp kVirtualStart{
      1'000'000'000'000};  // 1000 s after a machine's start, on every run

  void produce();
  [[nodiscard]] Duration length() const noexcept;
  void wait_for_exposures();
  [[nodiscard]] bool wait_for_its_turn(std::uint64_t pulse);
  void make_link_events(std::uint64_t pulse);
  [[nodiscard]] bool left_out(std::uint64_t pulse);
  void make_report(std::uint64_t pulse);
  /// Feedback of camera k for this pulse.
  [[nodiscard]] PulseExposure feedback(std::uint64_t pulse, int k) const;
  [[nodiscard]] bool pulsed(int k) const noexcept {
    return (board_.lines >> static_cast<unsigned>(k) & 1U) != 0;
  }
  [[nodiscard]] bool unplugged_at(Duration time, int k) const noexcept;
  [[nodiscard]] PulseAt pulse_at(std::uint64_t pulse, int k) const noexcept;
  [[nodiscard]] std::uint32_t boot_of(std::uint64_t pulse) const noexcept;
  void make_readings(HostStamp until);
  void make_frames(std::uint64_t pulse);
  /// Returns true if camera k is connected at this pulse; posts disconnects and reconnects.
  [[nodiscard]] bool present(std::uint64_t pulse, int k);
  /// Image of camera k for this pulse, with a slot; nullopt if it is lost.
  [[nodiscard]] std::optional<Shooting> plan(std::uint64_t pulse, int k);
  void render(const Shooting& shooting);
  void send(std::uint64_t pulse, const Shooting& shooting);
  [[nodiscard]] std::optional<FrameSlot> slot_of(int k);
  [[nodiscard]] HostStamp jittered(HostStamp least, std::uint64_t device,
                                   std::uint64_t number) const noexcept;
  [[nodiscard]] HostStamp host_of(std::uint64_t pulse) const noexcept {
    return start_ + plan_.at(static_cast<std::size_t>(pulse)).time;
  }
  [[nodiscard]] bool stopping() const noexcept { return stop_.load(std::memory_order_acquire); }

  RigContext& rig_;
  std::vector<std::unique_ptr<MockCamera>>& cameras_;
  MockIns& ins_;
  MockTrigger* trigger_ = nullptr;

  TriggerConfiguration board_{};
  PulsePlan plan_;
  HostStamp start_ = kVirtualStart;
  std::uint64_t readings_ = 0;
  std::size_t link_events_ = 0;  // of the plan, posted
  bool resumed_ = true;          // the next pulse is the first after a start or a pause
  PauseWindow pauses_;
  std::array<Sender, kMaxCameras> senders_{};
  std::atomic<bool> stop_{false};
  DeliveryQueue queue_{rig_, cameras_, ins_, stop_};
  std::thread producer_;
};

}  // namespace vergence::mock
