#pragma once
#include <mutex>
#include <optional>
#include <string>

#include "drivers/camera.hpp"
#include "drivers/v4l2/capture_queue.hpp"
#include "drivers/v4l2/capture_thread.hpp"
#include "drivers/v4l2/controls.hpp"
#include "drivers/v4l2/frame_exchange.hpp"
#include "drivers/v4l2/node.hpp"
#include "drivers/v4l2/settings.hpp"
#include "drivers/v4l2/stamps.hpp"

namespace vergence::v4l2 {

/// A camera behind a video node: drivers/camera.hpp and v4l2.hpp have the contract.
///
/// The CaptureThread alone calls the kernel while streaming; the owner does in between. What
/// passes between them, the consumer and the releaser goes through the FrameExchange.
class V4l2Camera final : public CameraDevice {
 public:
  /// An open node; `node.found_by` is what it is found by after an unplug.
  V4l2Camera(UniqueFd fd, Node node);
  ~V4l2Camera() override;

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration& requested,
                         CameraConfiguration* actual) noexcept override;
  DeviceTiming timing() const noexcept override;
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override {
    return exchange_.wait(limit, frame);
  }
  ImageView view(FrameSlot slot) const noexcept override { return exchange_.view(slot); }
  void release(FrameSlot slot) noexcept override;
  void stop() noexcept override;
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override;
  std::string last_error() const override { return last_error_; }
  std::string remark() const override { return settings_ ? settings_->remark : std::string(); }
  CameraStatistics statistics() const noexcept override { return exchange_.statistics(); }

 private:
  DeviceStatus bring_to(const CameraConfiguration& requested, bool keep_slots);
  DeviceStatus open_again();
  DeviceStatus start_streaming();
  DeviceStatus refuse(DeviceStatus status, std::string sentence) noexcept;
  void end_thread() noexcept;
  void close_node() noexcept;

  DeviceInfo info_;
  Node node_;
  std::mutex controlling_;  // of node, controls_ and settings_, between start() and set_exposure()
  UniqueFd fd_, subdevice_;
  Controls controls_;
  std::optional<CameraConfiguration> requested_;
  std::optional<Settings> settings_;
  std::optional<CaptureQueue> queue_;
  StampKind stamps_ = StampKind::none;  // as the buffers' description says before the first comes
  std::string last_error_;
  bool lost_node_ = false;  // the descriptor is of a camera that is gone

  FrameExchange exchange_;
  CaptureThread capture_{exchange_};
};

}  // namespace vergence::v4l2
