#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "core/types/time.hpp"
#include "drivers/camera.hpp"
#include "drivers/common/frame_queue.hpp"
#include "drivers/common/last_error.hpp"
#include "drivers/common/published.hpp"
#include "drivers/gige/detail/frame_receiver.hpp"
#include "drivers/gige/detail/image_memory.hpp"
#include "drivers/gige/detail/session.hpp"
#include "drivers/gige/detail/slot_returns.hpp"

namespace vergence::gige {

/// Thread that calls a function every `interval`, first after one interval.
///
/// The owner calls start() and stop(). start() throws if no thread can be created. An exception
/// from `round` terminates the program.
///
///     watch_.start("vergence-watch", Duration::milliseconds(100), [this] { poll(); });
class PeriodicThread {
 public:
  ~PeriodicThread() { stop(); }

  /// Does nothing if the thread already runs. `name` has at most 15 letters and must outlive the
  /// thread.
  void start(const char* name, Duration interval, std::function<void()> round);
  /// Waits for the current round. Returns immediately if the thread does not run.
  void stop() noexcept;
  /// True while stop() waits; long rounds should check it.
  [[nodiscard]] bool stopping() const noexcept { return stopping_; }

 private:
  void work(const char* name, Duration interval, const std::function<void()>& round);

  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

/// `640 x 480`.
[[nodiscard]] std::string size_text(int width, int height);

/// GigE Vision camera; the contract is in drivers/camera.hpp and gige.hpp.
///
/// Aravis's receive thread fills buffers of the ImageMemory. The FrameReceiver turns them into
/// frames for the FrameQueue. A supervisor thread detects a camera that no longer responds or
/// sends, then reopens and configures it with increasing pauses until start() can resume.
///
/// Threads  The mutex device_ guards the session between owner and supervisor. Frames are delivered
///          without it.
/// Time     start() and stop() may take as long as the session's calls, 2.5 s each for a
///          disconnected camera.
class GigeCamera final : public CameraDevice {
 public:
  explicit GigeCamera(std::unique_ptr<Session> session);
  ~GigeCamera() override;

  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus configure(const CameraConfiguration& requested,
                         CameraConfiguration* actual) noexcept override;
  DeviceTiming timing() const noexcept override;
  DeviceStatus start(Notifier* ready) noexcept override;
  DeviceStatus wait(Duration limit, Frame* frame) noexcept override {
    return queue_.wait(limit, frame);
  }
  ImageView view(FrameSlot slot) const noexcept override { return memory_.view(slot); }
  void release(FrameSlot slot) noexcept override { slots_.release(slot); }
  void stop() noexcept override;
  DeviceStatus trigger_once() noexcept override;
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override;
  std::string last_error() const override { return last_error_.get(); }
  std::string remark() const override;
  CameraStatistics statistics() const noexcept override { return queue_.statistics(); }

 private:
  [[nodiscard]] std::unique_ptr<Session> open_ours(const std::string& address,
                                                   std::string* why) const;
  [[nodiscard]] DeviceStatus reach();
  [[nodiscard]] DeviceStatus apply_again();
  [[nodiscard]] DeviceStatus begin(Notifier* ready);
  void close_stream(bool reachable) noexcept;

  // The supervisor.
  struct Watch;
  struct Fault {
    // Empty if there is no fault.
    std::string reason;
    // True if the camera still responds.
    bool reachable = true;
  };
  void start_supervising();
  void supervise(Watch* watch);
  [[nodiscard]] Fault check(HostStamp now, HostStamp* asked);
  void lose(const Fault& fault);
  [[nodiscard]] bool reopen();

  DeviceInfo info_;
  // Guards session_ and address_.
  mutable std::mutex device_;
  std::unique_ptr<Session> session_;
  // Last address of the camera; info_.place is its first one.
  std::string address_;
  LastError last_error_;
  // Remark of the session.
  Published<std::string> remark_;

  // Set by configure(); constant while streaming.
  CameraConfiguration requested_{};
  Options options_{};
  Applied applied_{};
  // Exposure and gain in the camera's registers; guarded by device_.
  ExposureSetting in_force_{};
  // `stale_` means that the camera may hold parts of a rejected configuration.
  bool configured_ = false, stale_ = false;

  ImageMemory memory_;
  FrameQueue queue_;
  SlotReturns slots_{queue_};
  FrameReceiver receiver_{queue_, slots_, memory_};
  PeriodicThread supervisor_;
};

}  // namespace vergence::gige
