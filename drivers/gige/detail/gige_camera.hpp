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

/// A thread that does something every `interval`, the first time after one of them.
///
/// Threads  start(), stop(): the owner. stopping(): any. Memory: start()'s.
/// Errors   start() throws where there is no thread. What `round` throws ends the program.
///
///     watch_.start("vergence-watch", Duration::milliseconds(100), [this] { poll(); });
class PeriodicThread {
 public:
  ~PeriodicThread() { stop(); }

  /// Nothing happens where it runs already. `name`: at most 15 letters, and it stays.
  void start(const char* name, Duration interval, std::function<void()> round);
  /// Returns when the round in progress is over; at once where none runs.
  void stop() noexcept;
  /// For long rounds: stop() is waiting.
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

/// A GigE Vision camera: drivers/camera.hpp and gige.hpp have the contract.
///
/// Aravis's receive thread fills buffers of the ImageMemory, the FrameReceiver makes frames of them
/// and offers them to the FrameQueue. A supervisor watches while
/// streaming: a camera that answers no more, or sends no more, is gone; then it opens and
/// configures it again, with growing pauses, until start() can go on.
/// Threads  The owner, Aravis's, the supervisor; the session is under device_, which the frames'
///          way never takes.
/// Time     stop() and start() may take as long as the session's calls: 2.5 s each, once the camera
///          has gone.
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
    std::string reason;     // empty: none
    bool reachable = true;  // it still answers
  };
  void start_supervising();
  void supervise(Watch* watch);
  [[nodiscard]] Fault check(HostStamp now, HostStamp* asked);
  void lose(const Fault& fault);
  [[nodiscard]] bool reopen();

  DeviceInfo info_;
  mutable std::mutex device_;  // session_, address_
  std::unique_ptr<Session> session_;
  std::string address_;  // where it was last; info_.place is where it was first
  LastError last_error_;
  Published<std::string> remark_;  // of the session

  // Set by configure(); constant while streaming.
  CameraConfiguration requested_{};
  Options options_{};
  Applied applied_{};
  ExposureSetting in_force_{};               // what the camera's registers hold; under device_
  bool configured_ = false, stale_ = false;  // stale: the camera may hold what was refused

  ImageMemory memory_;
  FrameQueue queue_;
  SlotReturns slots_{queue_};
  FrameReceiver receiver_{queue_, slots_, memory_};
  PeriodicThread supervisor_;
};

}  // namespace vergence::gige
