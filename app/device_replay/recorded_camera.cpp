#include "app/device_replay/recorded_camera.hpp"

#include <utility>

namespace vergence::app {
namespace {

// More than an acquisition holds on its way: its ring, its open sets, and what it is about to take.
constexpr std::size_t kSlots = 1024;

}  // namespace

RecordedCamera::RecordedCamera(const RecordedDevice& device,
                               const std::vector<DeviceStep<Frame>>& frames, Pixels pixels)
    : device_(device), steps_(frames), pixels_(std::move(pixels)), frames_of_slots_(kSlots) {}

DeviceStatus RecordedCamera::configure(const CameraConfiguration& requested,
                                       CameraConfiguration* actual) noexcept {
  try {
    if (actual != nullptr) *actual = requested;
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus RecordedCamera::wait(Duration /*limit*/, Frame* frame) noexcept {
  const DeviceStatus status = steps_.take(frame);
  if (status != DeviceStatus::ok) return status;
  const std::size_t slot = steps_.index() % kSlots;
  frames_of_slots_[slot] = steps_.index();
  frame->slot = static_cast<FrameSlot>(slot);
  return status;
}

ImageView RecordedCamera::view(FrameSlot slot) const noexcept {
  return pixels_(frames_of_slots_[slot]);
}

CameraStatistics RecordedCamera::statistics() const noexcept {
  CameraStatistics s;
  s.delivered = steps_.taken();
  return s;
}

DeviceStatus RecordedTrigger::configure(const TriggerConfiguration& requested,
                                        TriggerConfiguration* actual) noexcept {
  if (actual != nullptr) *actual = requested;
  return DeviceStatus::ok;
}

DeviceStatus RecordedInsDevice::configure(double rate_hz, double* actual_hz) noexcept {
  if (actual_hz != nullptr) *actual_hz = rate_hz;
  return DeviceStatus::ok;
}

}  // namespace vergence::app
