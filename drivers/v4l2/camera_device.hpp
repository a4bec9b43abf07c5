#pragma once
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/camera.hpp"
#include "drivers/exposure/applied_exposure.hpp"
#include "drivers/v4l2/capture_queue.hpp"
#include "drivers/v4l2/controls.hpp"
#include "drivers/v4l2/frame_exchange.hpp"
#include "drivers/v4l2/node.hpp"
#include "drivers/v4l2/settings.hpp"
#include "drivers/v4l2/stamps.hpp"

namespace vergence::v4l2 {

/// The thread that waits for filled buffers, makes frames of them (number, time, exposure, state)
/// and gives buffers that come back to the kernel again.
///
/// Threads  start(), stop(), enqueue_free(): the owner. wake(), change_exposure(): any one.
/// Memory   None while it runs.
/// Errors   A camera that is disconnected, or whose driver returns only errors, ends the thread;
///          FrameExchange has the status.
class CaptureThread {
 public:
  /// Outlives it.
  explicit CaptureThread(FrameExchange& exchange);
  ~CaptureThread() { stop(); }

  /// Gives the kernel every buffer that it may have. Precondition: stopped.
  void enqueue_free(CaptureQueue& queue) noexcept;
  /// The queue streams. All three outlive stop(); of the settings nothing but exposure and gain
  /// changes. Throws where there is no thread.
  void start(CaptureQueue& queue, const Settings& settings, int fd);
  /// Precondition: the exchange has ended, or was lost. False: it did not run.
  bool stop() noexcept;
  /// Something came back, or it shall end.
  void wake() const noexcept;
  /// The camera's registers hold this from now on.
  void change_exposure(const ExposureSetting& setting) noexcept;

 private:
  void capture() noexcept;
  void enqueue_returned() noexcept;
  [[nodiscard]] bool dequeue_filled() noexcept;
  void handle(Filled filled) noexcept;
  [[nodiscard]] bool hand_over(const Filled& filled, Frame frame) noexcept;
  void give_back(std::uint32_t buffer) noexcept;

  FrameExchange& exchange_;
  UniqueFd wake_;
  CaptureQueue* queue_ = nullptr;
  const Settings* settings_ = nullptr;
  int fd_ = -1;
  std::optional<SequenceCounter> counter_;
  std::optional<Raster> raster_;
  exposure::AppliedExposure exposures_;
  Duration last_exposure_{};     // of the last frame
  std::size_t with_kernel_ = 0;  // buffers
  int poll_errors_ = 0;
  std::thread thread_;
};

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
  DeviceStatus refuse(DeviceStatus status, std::string message) noexcept;
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
