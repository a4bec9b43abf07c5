#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <vector>

#include "core/memory/arena.hpp"
#include "core/types/time.hpp"
#include "drivers/camera.hpp"
#include "drivers/common/wake_event.hpp"
#include "drivers/ins.hpp"
#include "drivers/mock/detail/oscillator.hpp"
#include "drivers/mock/ins_model.hpp"
#include "drivers/mock/mock_rig.hpp"
#include "drivers/stream.hpp"
#include "drivers/trigger.hpp"

/// Simulated devices as seen by their consumers; the scheduler delivers data through their streams.
namespace vergence::mock {

/// Exposure settings of a simulated camera by pulse: each applies from its pulse to the next
/// change.
///
/// Thread-safe. Grows with changes that are not yet reached. change() may throw std::bad_alloc; the
/// settled pulses are then unchanged.
class ExposurePlan {
 public:
  /// Applies from the first pulse on.
  void reset(const ExposureSetting& setting) {
    const std::lock_guard lock(mutex_);
    changes_ = {{0, setting}};
  }
  /// Applies from this pulse on and replaces later changes. Settings used only before pulse `past`
  /// are dropped. Precondition: reset().
  void change(std::uint64_t from, const ExposureSetting& setting, std::uint64_t past) {
    const std::lock_guard lock(mutex_);
    while (changes_.size() > 1 && changes_.back().from >= from) changes_.pop_back();
    while (changes_.size() > 1 && changes_[1].from < past) changes_.erase(changes_.begin());
    changes_.push_back({from, setting});
  }
  /// Precondition: reset(); the setting of this pulse was not dropped.
  [[nodiscard]] ExposureSetting at(std::uint64_t pulse) const {
    const std::lock_guard lock(mutex_);
    ExposureSetting setting = changes_.front().setting;
    for (const Change& c : changes_)
      if (c.from <= pulse) setting = c.setting;
    return setting;
  }

 private:
  struct Change {
    // Pulse of the change.
    std::uint64_t from = 0;
    ExposureSetting setting{};
  };

  mutable std::mutex mutex_;
  // Ordered by pulse; the first one is in effect.
  std::vector<Change> changes_;
};

using vergence::Delivery;
using vergence::Stream;

/// Shared state of the devices of one rig.
struct RigContext {
  std::shared_ptr<const RigTruth> truth;
  MockRigOptions options;
  /// Signalled by a consumer that has freed a slot or a place in a stream.
  WakeEvent room;
  /// True while the scheduler's threads use the devices.
  std::atomic<bool> pulsing{false};
  // State of camera 0 for exposure control: pulse of the last image handed out, number of images
  // that wait, and whether the consumer is processing one.
  std::atomic<std::uint64_t> looked_at{0};
  std::atomic<int> unseen{0};
  std::atomic<bool> looking{false};
  /// Number of pulses whose exposures are settled.
  std::atomic<std::uint64_t> planned{0};
};

/// Transfer time of an image over its bus.
inline constexpr Duration kTransfer = Duration::milliseconds(5);
/// Delay of filter and serial link.
inline constexpr Duration kInsLatency = Duration::milliseconds(4);
/// Delay of a pulse's report.
inline constexpr Duration kReportLatency = Duration::milliseconds(1);

class MockCamera final : public CameraDevice {
 public:
  MockCamera(RigContext* rig, int k);
  ~MockCamera() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration& requested,
                         CameraConfiguration* actual) noexcept override;
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override;
  DeviceTiming timing() const noexcept override {
    return {trigger_delay() + configuration_.exposure + kTransfer};
  }
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override;
  ImageView view(FrameSlot slot) const noexcept override { return pool_->view(slot); }
  void release(FrameSlot slot) noexcept override;
  void stop() noexcept override;
  CameraStatistics statistics() const noexcept override;

  // Used by the scheduler.
  Stream<Frame, 64> stream;
  std::atomic<std::uint64_t> underruns{0}, lost{0};
  /// Delay from the edge of a pulse to the start of the exposure.
  [[nodiscard]] Duration trigger_delay() const noexcept {
    return rig_->options.trigger_delay[static_cast<std::size_t>(k_)];
  }
  [[nodiscard]] FramePool& pool() noexcept { return *pool_; }
  /// Exposure setting of that pulse's image.
  [[nodiscard]] ExposureSetting setting_at(std::uint64_t pulse) const {
    return exposures_.at(pulse);
  }
  /// Records the pulse of the image in a slot.
  void label(FrameSlot slot, std::uint64_t pulse) noexcept {
    pulse_of_[slot].store(pulse, std::memory_order_release);
  }
  [[nodiscard]] const DeviceOscillator& clock() const noexcept { return clock_; }
  /// Image memory in bytes.
  [[nodiscard]] std::size_t bytes() const noexcept { return arena_ ? arena_->used() : 0; }
  /// Renders the image through this camera's lens and sensor into width x height bytes, in rows of
  /// the pool's stride.
  void render(std::span<const Transform> T_camera_enu, std::span<const Transform> T_camera_bus,
              const RenderRequest& shot, std::uint8_t* out);

 private:
  void allocate(const Intrinsics& lens);

  RigContext* rig_;
  int k_;
  DeviceInfo info_;
  DeviceOscillator clock_;
  CameraConfiguration configuration_{};
  std::unique_ptr<Arena> arena_;
  std::unique_ptr<FramePool> pool_;
  std::unique_ptr<Renderer> renderer_;
  // Empty if the renderer's image is output directly.
  std::vector<std::uint8_t> mosaic_;
  std::atomic<std::uint64_t> delivered_{0}, starts_{0};
  // Number of slots held by the consumer.
  std::atomic<int> out_{0};
  std::array<std::atomic<std::uint64_t>, MockRig::kSlots> pulse_of_{};
  ExposurePlan exposures_;
  // Used by the consumer only.
  bool disconnected_ = false;
};

class MockIns final : public InsDevice {
 public:
  explicit MockIns(RigContext* rig);
  ~MockIns() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  DeviceTiming timing() const noexcept override { return {kInsLatency}; }
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, InsReading* reading) noexcept override;
  void stop() noexcept override;
  InsStatistics statistics() const noexcept override;

  // Used by the scheduler.
  static constexpr std::size_t kRing = 1024;
  Stream<InsReading, kRing> stream;
  std::atomic<std::uint64_t> lost{0}, overruns{0};
  [[nodiscard]] InsModel& model() noexcept { return *model_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_; }
  [[nodiscard]] const DeviceOscillator& clock() const noexcept { return clock_; }

 private:
  RigContext* rig_;
  DeviceInfo info_{"mock", "mock-ins", "simulated MTi-G", "world"};
  DeviceOscillator clock_;
  std::unique_ptr<InsModel> model_;
  double rate_ = 0;
  std::atomic<std::uint64_t> delivered_{0};
};

/// Receives start and stop of the simulated trigger board.
class PulseListener {
 public:
  virtual ~PulseListener() = default;
  /// Throws std::exception on failure.
  virtual void begin(const TriggerConfiguration& c) = 0;
  /// May be called twice.
  virtual void halt() noexcept = 0;
  /// Omits this number of slots of the plan from `from` on in this boot, except those already made.
  virtual void leave_out(std::uint64_t from, std::uint32_t pulses, std::uint32_t boot) noexcept = 0;
};

/// Pulse and its slot in the plan.
struct BoardReport {
  Pulse pulse{};
  std::uint64_t slot = 0;
};

class MockTrigger final : public TriggerDevice {
 public:
  /// The listener must outlive this object.
  MockTrigger(RigContext* rig, PulseListener* listener);
  ~MockTrigger() override { stop(); }

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const TriggerConfiguration& requested,
                         TriggerConfiguration* actual) noexcept override;
  DeviceTiming timing() const noexcept override { return {kReportLatency}; }
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, Pulse* pulse) noexcept override;
  /// Starts at the fourth slot after that of the newest report popped. A request during a pause has
  /// no effect.
  DeviceStatus pause(std::uint32_t pulses) noexcept override;
  void stop() noexcept override;
  TriggerStatistics statistics() const noexcept override;

  // Used by the scheduler.
  static constexpr std::size_t kRing = 64;
  Stream<BoardReport, kRing> stream;
  std::atomic<std::uint64_t> overruns{0}, lost{0}, reboots{0};
  [[nodiscard]] const DeviceOscillator& clock() const noexcept { return clock_; }
  [[nodiscard]] const TriggerConfiguration& configuration() const noexcept {
    return configuration_;
  }

 private:
  RigContext* rig_;
  PulseListener* listener_;
  DeviceInfo info_{"mock", "mock-board", "simulated trigger board", "world"};
  DeviceOscillator clock_;
  TriggerConfiguration configuration_{};
  std::atomic<bool> disconnected_{false};
  std::atomic<std::uint64_t> pulses_{0}, starts_{0};
  // Guards the members below.
  std::mutex asking_;
  bool any_ = false;
  // Slot and boot of the report popped last.
  std::uint64_t newest_ = 0;
  std::uint32_t boot_ = 0;
  // Slot after the last requested pause.
  std::uint64_t pause_end_ = 0;
  std::uint32_t pause_boot_ = 0;
};

}  // namespace vergence::mock
