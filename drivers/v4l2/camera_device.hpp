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

/// Thread that waits for filled buffers, turns them into frames (number, time, exposure, status)
/// and returns released buffers to the kernel.
///
/// Threads  The owner calls start(), stop() and enqueue_free(). wake() and change_exposure() are
///          thread-safe.
/// Memory   Does not allocate while it runs.
/// Errors   The thread ends if the camera is disconnected or its driver returns only errors;
///          FrameExchange has the status.
class CaptureThread {
 public:
  /// The exchange must outlive this object.
  explicit CaptureThread(FrameExchange& exchange);
  ~CaptureThread() { stop(); }

  /// Queues every buffer that the kernel may have. Precondition: stopped.
  void enqueue_free(CaptureQueue& queue) noexcept;
  /// Starts the thread on a streaming queue. All arguments must stay valid until stop(); only
  /// exposure and gain of the settings may change. Throws if no thread can be created.
  void start(CaptureQueue& queue, const Settings& settings, int fd);
  /// Returns false if the thread did not run. Precondition: the exchange has ended or was lost.
  bool stop() noexcept;
  /// Wakes the thread because a buffer was released or the thread is to end.
  void wake() const noexcept;
  /// Reports that the camera's registers now hold this setting.
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
  // Exposure time of the last frame.
  Duration last_exposure_{};
  // Number of buffers queued in the kernel.
  std::size_t with_kernel_ = 0;
  int poll_errors_ = 0;
  std::thread thread_;
};

/// Camera behind a video node; the contract is in drivers/camera.hpp and v4l2.hpp.
///
/// While streaming, only the CaptureThread calls the kernel; otherwise only the owner does. The
/// FrameExchange passes frames and buffers between them, the consumer and the releaser.
class V4l2Camera final : public CameraDevice {
 public:
  /// Takes an open node; `node.found_by` identifies it after a disconnect.
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
  // Guards the node, controls_ and settings_ between start() and set_exposure().
  std::mutex controlling_;
  UniqueFd fd_, subdevice_;
  Controls controls_;
  std::optional<CameraConfiguration> requested_;
  std::optional<Settings> settings_;
  std::optional<CaptureQueue> queue_;
  // Kind of stamps according to the buffers' description, known before the first frame.
  StampKind stamps_ = StampKind::none;
  std::string last_error_;
  // True if the descriptor belongs to a disconnected camera.
  bool lost_node_ = false;

  FrameExchange exchange_;
  CaptureThread capture_{exchange_};
};

}  // namespace vergence::v4l2
