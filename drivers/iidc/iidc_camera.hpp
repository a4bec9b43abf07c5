#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include "drivers/camera.hpp"
#include "drivers/common/frame_queue.hpp"
#include "drivers/exposure/applied_exposure.hpp"
#include "drivers/iidc/bus.hpp"
#include "drivers/iidc/camera_plan.hpp"
#include "drivers/iidc/frame_reader.hpp"
#include "drivers/iidc/slot_memory.hpp"

namespace vergence::iidc {

/// IIDC camera on any bus, with the contract of drivers/camera.hpp. Slots are the bus's buffers;
/// only modes that are not 8-bit grey are converted, on the stream's thread, into memory of the
/// camera.
///
/// Counter   The camera's embedded one, if any: gaps are exposures that were not received. `lost`
///           counts them once a later frame has arrived.
/// Stamps    The camera's embedded clock (common to all cameras of a 1394 bus), else the arrival.
/// Unplug    Reported by the bus, after kStrays misaligned frames, or when a free-running camera is
///           silent (longest_silence()); start() resumes.
/// Restart   start() writes all registers again, so the configuration survives a stop or a
///           reconnect.
class IidcCamera final : public CameraDevice, private StreamSink {
 public:
  static constexpr int kStrays = 8;

  /// `rom` is that of this camera. A null `clock` means that the camera has its own. `patience`
  /// limits the wait for a register to become ready.
  IidcCamera(std::unique_ptr<CameraBus> bus, const ConfigRom& rom,
             std::shared_ptr<SharedClock> clock, Duration patience = Duration::seconds(1));
  ~IidcCamera() override;
  IidcCamera(const IidcCamera&) = delete;
  IidcCamera& operator=(const IidcCamera&) = delete;

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return bus_->info(); }
  [[nodiscard]] DeviceStatus configure(const CameraConfiguration& requested,
                                       CameraConfiguration* actual) noexcept override;
  [[nodiscard]] DeviceTiming timing() const noexcept override;
  [[nodiscard]] DeviceStatus start(Notifier* ready) noexcept override;
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept override;
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept override;
  void release(FrameSlot slot) noexcept override;
  void stop() noexcept override;
  [[nodiscard]] DeviceStatus trigger_once() noexcept override;
  [[nodiscard]] DeviceStatus set_exposure(const ExposureSetting& requested,
                                          ExposureSetting* actual) noexcept override;
  [[nodiscard]] std::string last_error() const override { return last_error_; }
  [[nodiscard]] std::string remark() const override;
  [[nodiscard]] CameraStatistics statistics() const noexcept override {
    return queue_.statistics();
  }

  /// The applied plan; mode and packets serve the diagnosis of a bus. Owner's thread only.
  [[nodiscard]] const CameraPlan& plan() const noexcept { return plan_; }

 private:
  [[nodiscard]] bool frame(const Arrival& arrival) noexcept override;
  void disconnected(HostStamp at) noexcept override;
  [[nodiscard]] DeviceStatus configure_or_throw(const CameraConfiguration& requested,
                                                CameraConfiguration* actual);
  [[nodiscard]] DeviceStatus begin(Notifier* ready);
  [[nodiscard]] Duration transfer_time() const noexcept;
  /// → ok, stopped, disconnected
  [[nodiscard]] DeviceStatus standing() const noexcept;
  void return_slot(FrameSlot slot) noexcept;
  void drain() noexcept;
  [[nodiscard]] DeviceStatus refused(DeviceStatus status, std::string why);

  std::unique_ptr<CameraBus> bus_;
  std::shared_ptr<SharedClock> clock_;
  // Guards registers_, plan_ and the bus's start and stop between the owner, trigger_once() and
  // set_exposure().
  std::mutex asking_;
  CameraRegisters registers_;
  CameraPlan plan_{};
  bool configured_ = false;
  std::string last_error_;

  // Used only by the stream's thread.
  FrameReader reader_;
  exposure::AppliedExposure exposures_;
  // Transfer time of a frame, and exposure of the last one.
  Duration transfer_{}, exposure_now_{};
  // Converted images, if the bus's buffers are not the images.
  SlotMemory converted_;
  int strays_ = 0;

  FrameQueue queue_;
  // True if the device is disconnected, reported or not.
  std::atomic<bool> lost_{false};
};

}  // namespace vergence::iidc
