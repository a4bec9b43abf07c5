#pragma once
#include <array>
#include <limits>

#include "drivers/camera.hpp"

namespace vergence::test {

/// A mock's camera that records for every slot it hands out when the image was exposed: the arrival
/// less the least delay.
///
/// Ownership  The camera outlives it. Threads: CameraDevice's; edge_of_slot by the consumer, while
///            it has the slot.
class WatchedCamera final : public CameraDevice {
 public:
  explicit WatchedCamera(CameraDevice* camera) : camera_(camera) {}
  const DeviceInfo& info() const noexcept override { return camera_->info(); }
  DeviceStatus configure(const CameraConfiguration& c,
                         CameraConfiguration* actual) noexcept override {
    return camera_->configure(c, actual);
  }
  DeviceTiming timing() const noexcept override { return camera_->timing(); }
  DeviceStatus start(Notifier* ready) noexcept override {
    if (++starts > 1) hangs_from = kNever;
    return camera_->start(ready);
  }
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override {
    const DeviceStatus status = camera_->wait(limit, frame);
    if (status == DeviceStatus::ok && frame->arrival > hangs_from) {
      camera_->release(frame->slot);
      return DeviceStatus::timeout;
    }
    if (status == DeviceStatus::ok)
      edge_of_slot[frame->slot] = frame->arrival - camera_->timing().min_delay;
    return status;
  }
  ImageView view(FrameSlot slot) const noexcept override { return camera_->view(slot); }
  void release(FrameSlot slot) noexcept override { camera_->release(slot); }
  void stop() noexcept override { camera_->stop(); }
  CameraStatistics statistics() const noexcept override { return camera_->statistics(); }

  // The stamp is at most 1.9 ms after the true edge: the mock's jitter.
  std::array<HostStamp, 64> edge_of_slot{};

  static constexpr HostStamp kNever{std::numeric_limits<std::int64_t>::max()};
  // The camera sends nothing from then on until it is started again.
  HostStamp hangs_from = kNever;
  int starts = 0;

 private:
  CameraDevice* camera_;
};

}  // namespace vergence::test
