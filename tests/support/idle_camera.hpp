#pragma once
#include "drivers/camera.hpp"

namespace vergence::test {

/// A camera that accepts every call and gives no frame: the base of a test's own cameras.
class IdleCamera : public CameraDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration&, CameraConfiguration*) noexcept override {
    return DeviceStatus::ok;
  }
  DeviceTiming timing() const noexcept override { return {}; }
  DeviceStatus start(Notifier*) noexcept override { return DeviceStatus::ok; }
  DeviceStatus wait(Duration, Frame*) noexcept override { return DeviceStatus::timeout; }
  ImageView view(FrameSlot) const noexcept override { return {}; }
  void release(FrameSlot) noexcept override {}
  void stop() noexcept override {}
  CameraStatistics statistics() const noexcept override { return {}; }

 private:
  DeviceInfo info_{};
};

}  // namespace vergence::test
