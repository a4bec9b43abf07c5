#pragma once
#include <array>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/camera.hpp"
#include "drivers/exposure/applied_exposure.hpp"
#include "drivers/v4l2/capture_queue.hpp"
#include "drivers/v4l2/controls.hpp"
#include "drivers/v4l2/node.hpp"
#include "drivers/v4l2/settings.hpp"
#include "drivers/v4l2/slots.hpp"
#include "drivers/v4l2/stamps.hpp"

namespace vergence::v4l2 {

inline constexpr std::size_t kBufferReserve =
    2;  // the kernel always has: with none it drops frames, and nobody knows how many

/// A camera behind a video node: drivers/camera.hpp and v4l2.hpp have the contract.
///
/// The capture thread alone calls the kernel while streaming; the owner does in between. What
/// passes between them, the consumer and the releaser is under one mutex that nobody holds across a
/// system call that may wait.
class V4l2Camera final : public CameraDevice {
 public:
  /// An open node; `node.serial` is what it is found by after an unplug.
  V4l2Camera(UniqueFd fd, Node node);
  ~V4l2Camera() override;

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration& requested,
                         CameraConfiguration* actual) noexcept override;
  DeviceTiming timing() const noexcept override;
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override;
  ImageView view(FrameSlot slot) const noexcept override { return slots_.view(slot); }
  void release(FrameSlot slot) noexcept override;
  void stop() noexcept override;
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override;
  std::string last_error() const override { return last_error_; }
  std::string remark() const override { return settings_ ? settings_->remark : std::string(); }
  CameraStatistics statistics() const noexcept override;

 private:
  // The owner's.
  DeviceStatus bring_to(const CameraConfiguration& requested, bool keep_slots);
  DeviceStatus open_again();
  DeviceStatus start_streaming();
  DeviceStatus refuse(DeviceStatus status, std::string sentence) noexcept;
  void end_thread() noexcept;
  void forget_buffers() noexcept;
  void close_node() noexcept;

  // The capture thread's.
  void capture() noexcept;
  void enqueue_returned() noexcept;
  [[nodiscard]] bool take_filled() noexcept;
  void handle(Filled filled) noexcept;
  [[nodiscard]] bool hand_over(const Filled& filled, Frame frame) noexcept;
  void give_back(std::uint32_t buffer) noexcept;
  void leave() noexcept;
  void wake_capture() const noexcept;

  DeviceInfo info_;
  Node node_;
  std::mutex controlling_;  // of node, controls_ and settings_, between start() and set_exposure()
  UniqueFd fd_, subdevice_, wake_;
  Controls controls_;
  std::optional<CameraConfiguration> requested_;
  std::optional<Settings> settings_;
  std::optional<CaptureQueue> queue_;
  StampKind stamps_ = StampKind::none;  // as the buffers' description says before the first comes
  std::string last_error_;
  bool lost_node_ = false;  // the descriptor is of a camera that is gone
  std::thread thread_;

  // Of the capture thread while it runs.
  Notifier* notifier_ = nullptr;
  std::optional<SequenceCounter> counter_;
  std::optional<Raster> raster_;
  exposure::AppliedExposure exposures_;
  Duration exposure_now_{};      // of the last frame
  std::size_t with_kernel_ = 0;  // buffers
  int poll_errors_ = 0;

  // Under mutex_.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Slots slots_;
  std::array<Frame, Slots::kMost> ready_{};
  std::size_t ready_first_ = 0, ready_count_ = 0;
  std::array<std::uint32_t, Slots::kMost> returned_{};  // buffers for the kernel
  std::size_t returned_count_ = 0;
  bool streaming_ = false, gone_ = false, node_died_ = false;
  HostStamp gone_at_{};
  CameraStatistics statistics_{};
};

}  // namespace vergence::v4l2
