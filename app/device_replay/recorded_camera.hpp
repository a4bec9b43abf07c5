#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "app/datasets/device_recording.hpp"
#include "drivers/camera.hpp"
#include "drivers/ins.hpp"
#include "drivers/trigger.hpp"

/// Devices whose readings were recorded as they were handed out: cameras, and those that are on no
/// line. They give what there is at once; whoever merges them does so by its arrival.
namespace vergence::app {

/// Steps of a record, one after the other.
template <class Value>
class RecordedSteps {
 public:
  explicit RecordedSteps(const std::vector<DeviceStep<Value>>& steps) : steps_(steps) {}

  [[nodiscard]] DeviceStatus start() const noexcept {
    return next_ < steps_.size() ? DeviceStatus::ok : DeviceStatus::ended;
  }
  /// → ok, gone (value->arrival is set), ended
  [[nodiscard]] DeviceStatus take(Value* value) noexcept {
    if (next_ >= steps_.size()) return DeviceStatus::ended;
    const DeviceStep<Value>& step = steps_[next_++];
    if (!step.gone) *value = step.value;
    value->arrival = step.value.arrival;
    return step.gone ? DeviceStatus::gone : DeviceStatus::ok;
  }
  /// Of the step that take() gave last.
  [[nodiscard]] std::size_t index() const noexcept { return next_ - 1; }
  [[nodiscard]] std::uint64_t taken() const noexcept { return next_; }

 private:
  const std::vector<DeviceStep<Value>>& steps_;
  std::size_t next_ = 0;
};

/// A camera of a recorded drive.
///
/// Ownership  Frames and device outlive it. Slots are not kept: a view is valid until the next one.
/// Threads    As CameraDevice; view() is the consumer's.
class RecordedCamera final : public CameraDevice {
 public:
  /// Pixels of the frame with that index among the steps; empty: they were not recorded.
  using Pixels = std::function<ImageView(std::size_t frame)>;

  RecordedCamera(const RecordedDevice& device, const std::vector<DeviceStep<Frame>>& frames,
                 Pixels pixels);

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return device_.info; }
  [[nodiscard]] DeviceStatus configure(const CameraConfiguration& requested,
                                       CameraConfiguration* actual) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override { return device_.timing; }
  [[nodiscard]] DeviceStatus start(Notifier* /*ready*/) noexcept override { return steps_.start(); }
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept override;
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept override;
  void release(FrameSlot /*slot*/) noexcept override {}
  void stop() noexcept override {}
  [[nodiscard]] CameraStatistics statistics() const noexcept override;

 private:
  const RecordedDevice& device_;
  RecordedSteps<Frame> steps_;
  Pixels pixels_;
  std::vector<std::size_t> frames_of_slots_;
};

/// Pulses that a device on no line reported.
class RecordedTrigger final : public TriggerDevice {
 public:
  RecordedTrigger(const RecordedDevice& device, const std::vector<DeviceStep<Pulse>>& pulses)
      : device_(device), steps_(pulses) {}

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return device_.info; }
  [[nodiscard]] DeviceStatus configure(const TriggerConfiguration& requested,
                                       TriggerConfiguration* actual) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override { return device_.timing; }
  [[nodiscard]] DeviceStatus start(Notifier* /*ready*/) noexcept override { return steps_.start(); }
  [[nodiscard]] DeviceStatus wait(Duration /*limit*/, Pulse* pulse) noexcept override {
    return steps_.take(pulse);
  }
  /// Those that were left out then are left out.
  [[nodiscard]] DeviceStatus pause(std::uint32_t /*pulses*/) noexcept override {
    return DeviceStatus::ok;
  }
  void stop() noexcept override {}
  [[nodiscard]] TriggerStatistics statistics() const noexcept override { return {}; }

 private:
  const RecordedDevice& device_;
  RecordedSteps<Pulse> steps_;
};

/// An INS on no line: readings on the host's clock already, which arrive when they were measured.
class RecordedInsDevice final : public InsDevice {
 public:
  RecordedInsDevice(const RecordedDevice& device, const std::vector<DeviceStep<InsReading>>& steps)
      : device_(device), steps_(steps) {}

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return device_.info; }
  [[nodiscard]] DeviceStatus configure(double rate_hz, double* actual_hz) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override { return device_.timing; }
  [[nodiscard]] DeviceStatus start(Notifier* /*ready*/) noexcept override { return steps_.start(); }
  [[nodiscard]] DeviceStatus wait(Duration /*limit*/, InsReading* reading) noexcept override {
    return steps_.take(reading);
  }
  void stop() noexcept override {}
  [[nodiscard]] InsStatistics statistics() const noexcept override { return {}; }

 private:
  const RecordedDevice& device_;
  RecordedSteps<InsReading> steps_;
};

}  // namespace vergence::app
