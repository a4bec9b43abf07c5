#pragma once
#include <atomic>
#include <cstdint>
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

/// An IIDC camera, whatever it hangs on.
///
/// Contract as drivers/camera.hpp. Slots are the bus's buffers; only modes that are not 8-bit grey
/// are converted, on the stream's thread, into memory of the camera's own.
/// Counter   The camera's, where it embeds one: gaps are exposures that never arrived. `lost`
///           counts them as soon as a later one is here.
/// Stamps    The camera's own clock where it embeds it (on one 1394 bus common to all cameras),
///           else the arrival.
/// Gone      When the bus says so, when the stream is out of step for kStrays frames, or when a
///           free running camera is silent (longest_silence()): start() begins again.
/// Restart   start() writes all registers again: after a stop or a replug the camera is as
///           configured.
class IidcCamera final : public CameraDevice, private StreamSink {
 public:
  static constexpr int kStrays = 8;

  /// `rom` of this camera. `clock` null: the camera's clock is its own. `patience`: how long a
  /// register may take to become ready.
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

  /// The plan in force; its mode and packets are what the diagnosis of a bus needs. Owner's thread.
  [[nodiscard]] const CameraPlan& plan() const noexcept { return plan_; }

 private:
  [[nodiscard]] bool frame(const Arrival& arrival) noexcept override;
  void gone(HostStamp at) noexcept override;
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
  std::mutex asking_;  // of registers_, plan_ and the bus's start and stop: the owner's, and
                       // trigger_once(), set_exposure()
  CameraRegisters registers_;
  CameraPlan plan_{};
  bool configured_ = false;
  std::string last_error_;

  FrameReader reader_;  // the stream's thread
  exposure::AppliedExposure exposures_;
  Duration transfer_{}, exposure_now_{};  // of a frame over the bus; of the last frame
  SlotMemory converted_;                  // where the bus's buffers are not the image
  int strays_ = 0;

  FrameQueue queue_;
  std::atomic<bool> lost_{false};  // the device is gone, whether told or not
};

}  // namespace vergence::iidc
