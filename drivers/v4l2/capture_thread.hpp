#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <thread>

#include "drivers/exposure/applied_exposure.hpp"
#include "drivers/v4l2/capture_queue.hpp"
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
/// Errors   A camera that is gone, or whose driver gives only errors, ends the thread: the
///          FrameExchange knows it.
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
  [[nodiscard]] bool take_filled() noexcept;
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

}  // namespace vergence::v4l2
