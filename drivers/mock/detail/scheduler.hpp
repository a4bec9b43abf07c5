#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "drivers/mock/detail/delivery_queue.hpp"
#include "drivers/mock/detail/devices.hpp"
#include "drivers/mock/detail/exposure.hpp"
#include "drivers/mock/detail/pause_window.hpp"
#include "drivers/mock/detail/pulse_feed.hpp"
#include "drivers/mock/detail/pulse_plan.hpp"

namespace vergence::mock {

/// Makes what the devices deliver, pulse after pulse; the DeliveryQueue hands it out.
///
/// Threads  begin(), halt(): the owner's. One thread makes everything, a second one renders every
///          other camera.
/// Time     Virtual: what is made before the next pulse is delivered before it, and the producer
///          waits for room. Real: a pulse that is over before its pictures are begun has none.
/// Pauses   Virtual, with reports_taken: slot n is made once every report that arrives before it
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
  [[nodiscard]] std::array<PulseExposure, kMaxCameras> feed(HostStamp edge);
  void end_feed() noexcept { feed_.end(); }
  /// After the drive.
  [[nodiscard]] const PulsePlan& fed_plan() const noexcept { return fed_; }
  [[nodiscard]] PulsePlan plan_of(const TriggerConfiguration& c) const;
  /// The host's time at the drive's start.
  [[nodiscard]] HostStamp start() const noexcept { return start_; }
  [[nodiscard]] std::uint64_t pulses(double rate_hz) const noexcept;

 private:
  /// What the scheduler knows of a camera.
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
  /// Whether there is a slot n. Fed: once the one after it is known too, or that there is none.
  [[nodiscard]] bool has_slot(std::uint64_t n);
  [[nodiscard]] Duration length() const noexcept;
  void wait_for_exposures();
  [[nodiscard]] bool wait_for_its_turn(std::uint64_t pulse);
  void make_link_events(std::uint64_t pulse);
  [[nodiscard]] bool left_out(std::uint64_t pulse);
  void make_report(std::uint64_t pulse);
  /// What the feedback line of camera k tells of this pulse.
  [[nodiscard]] PulseExposure feedback(std::uint64_t pulse, int k) const;
  [[nodiscard]] bool pulsed(int k) const noexcept {
    return (board_.lines >> static_cast<unsigned>(k) & 1U) != 0;
  }
  [[nodiscard]] bool unplugged_at(Duration time, int k) const noexcept;
  [[nodiscard]] PulseAt pulse_at(std::uint64_t pulse, int k) const noexcept;
  [[nodiscard]] std::uint32_t boot_of(std::uint64_t pulse) const noexcept;
  void make_readings(HostStamp until);
  void make_frames(std::uint64_t pulse);
  /// Whether camera k is there at this pulse; posts its going and coming.
  [[nodiscard]] bool present(std::uint64_t pulse, int k);
  /// What camera k will send of this pulse, with a slot for it; nothing: it is lost.
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
  PulsePlan fed_;  // of who feeds
  std::array<Sender, kMaxCameras> senders_{};
  std::atomic<bool> stop_{false};
  PulseFeed feed_{stop_};
  DeliveryQueue queue_{rig_, cameras_, ins_, stop_};
  std::thread producer_;
};

}  // namespace vergence::mock
