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

/// Slots of a pulse plan that a pause omits. request() is thread-safe; the scheduler's producer
/// calls make(), slot by slot.
class PauseWindow {
 public:
  /// Omits this number of slots from `from` on in this boot (0: in any), except those already made.
  void request(std::uint64_t from, std::uint32_t pulses, std::uint32_t boot) noexcept {
    const std::lock_guard lock(mutex_);
    from = std::max(from, made_);
    pause_ = {from, from + pulses, boot};
  }
  /// Makes a slot of this boot. Returns true if it is omitted.
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
    // Range of slots.
    std::uint64_t from = 0, end = 0;
    // As in Pulse.
    std::uint32_t boot = 0;
  };
  std::mutex mutex_;
  std::optional<Pause> pause_;
  // Number of slots made.
  std::uint64_t made_ = 0;
};

/// Pulse as received by a camera.
struct PulseAt {
  /// Slot in the plan.
  std::uint64_t number = 0;
  /// Start of the exposure, since the start of the drive.
  Duration time{};
  const PulsePlan* plan = nullptr;
};

/// Image of one camera for one pulse under the active faults.
struct Exposure {
  /// Does not happen.
  bool missed = false;
  /// Does not arrive.
  bool lost = false;
  /// Arrives twice.
  bool twice = false;
  /// Additional delay of the arrival.
  Duration delay{};
  double brightness = 1;
  // Source of the image: usually this camera and pulse.
  int camera = 0;
  /// Also selects the noise.
  std::uint64_t pulse = 0;
  /// Start of the exposure.
  Duration time{};
};

/// Depends only on its arguments; `seed` determines the random draws of faults with a share.
[[nodiscard]] Exposure make_exposure(const RigTruth& truth, std::uint64_t seed,
                                     const PulseAt& pulse, int camera) noexcept;

/// Generates the devices' data pulse by pulse; the DeliveryQueue delivers them.
///
/// Threads  The owner calls begin() and halt(). One thread generates everything, a second renders
///          every other camera.
/// Time     Virtual: what is generated before the next pulse is delivered before it, and the
///          producer waits for room. Real: a pulse that is over before rendering starts has no
///          images.
/// Pauses   Virtual, with reports_read: slot n is made once every report that arrives before it was
///          popped. So when the consumer requests a pause at the report of slot m, slot m + 4 is
///          not made yet, because the report of m + 1 arrives within two periods of its pulse.
class Scheduler final : public PulseListener {
 public:
  /// All arguments must outlive the scheduler; attach() sets `trigger`.
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
  [[nodiscard]] PulsePlan make_plan(const TriggerConfiguration& c) const;
  /// Host time at the start of the drive.
  [[nodiscard]] HostStamp start() const noexcept { return start_; }
  [[nodiscard]] std::uint64_t pulses(double rate_hz) const noexcept;

 private:
  /// State of a camera in the scheduler.
  struct Sender {
    bool unplugged = false;
    // Slot minus the camera's counter.
    std::uint64_t counter_base = 0;
  };
  struct Shooting {
    // Camera that sends the image.
    int camera = 0;
    Exposure exposure{};
    FrameSlot slot = 0;
    ExposureSetting setting{};
  };
  // Fixed start of every run, 1000 s after boot.
  static constexpr HostStamp kVirtualStart{1'000'000'000'000};

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
  [[nodiscard]] std::optional<FrameSlot> get_slot(int k);
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
  // Number of posted link events of the plan.
  std::size_t link_events_ = 0;
  // True if the next pulse is the first after a start or a pause.
  bool resumed_ = true;
  PauseWindow pauses_;
  std::array<Sender, kMaxCameras> senders_{};
  std::atomic<bool> stop_{false};
  DeliveryQueue queue_{rig_, cameras_, ins_, stop_};
  std::thread producer_;
};

}  // namespace vergence::mock
