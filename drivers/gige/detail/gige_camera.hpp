#pragma once
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/memory/arena.hpp"
#include "drivers/camera.hpp"
#include "drivers/exposure/applied_exposure.hpp"
#include "drivers/gige/detail/block_counter.hpp"
#include "drivers/gige/detail/handover.hpp"
#include "drivers/gige/detail/session.hpp"

namespace vergence::gige {

/// `640 x 480`.
[[nodiscard]] std::string size_text(int width, int height);

/// A GigE Vision camera: drivers/camera.hpp and gige.hpp have the contract.
///
/// Aravis's receive thread fills buffers that are the slots (or, where the format is not 8-bit
/// grey, are converted into them) and offers them to the Handover. A supervisor watches while
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
    return handover_.wait(limit, frame);
  }
  ImageView view(FrameSlot slot) const noexcept override;
  void release(FrameSlot slot) noexcept override { handover_.release(slot); }
  void stop() noexcept override;
  DeviceStatus trigger_once() noexcept override;
  DeviceStatus set_exposure(const ExposureSetting& requested,
                            ExposureSetting* actual) noexcept override;
  std::string last_error() const override;
  std::string remark() const override;
  CameraStatistics statistics() const noexcept override { return handover_.statistics(); }

 private:
  [[nodiscard]] DeviceStatus refuse(DeviceStatus status, std::string sentence);
  /// Whether the camera can be asked now. → ok, stopped, gone
  [[nodiscard]] DeviceStatus standing() const noexcept;
  [[nodiscard]] DeviceStatus reach();
  [[nodiscard]] DeviceStatus apply_again();
  [[nodiscard]] DeviceStatus begin(Notifier* ready);
  void make_slots();
  void drop_buffers() noexcept;

  // Aravis's thread.
  static void called(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);
  void take(ArvBuffer* buffer) noexcept;
  [[nodiscard]] bool describe(ArvBuffer* buffer, HostStamp arrival, Frame* frame) noexcept;
  [[nodiscard]] bool right_size(ArvBuffer* buffer, bool chunks_in_place) noexcept;
  [[nodiscard]] std::optional<Duration> reported_exposure(ArvBuffer* buffer) const noexcept;
  void recycle() noexcept;

  // The supervisor.
  void supervise();
  struct Trouble {
    std::string why;        // empty: none
    bool reachable = true;  // it still answers
  };
  [[nodiscard]] Trouble what_is_wrong(HostStamp now, HostStamp* asked);
  void lose(const Trouble& trouble);
  [[nodiscard]] bool quitting();
  [[nodiscard]] bool reopen();

  DeviceInfo info_;
  mutable std::mutex device_;  // session_, address_
  std::unique_ptr<Session> session_;
  std::string address_;       // where it was last; info_.place is where it was first
  mutable std::mutex words_;  // last_error_, remark_
  std::string last_error_, remark_;

  // Of configure(); constant while streaming.
  CameraConfiguration requested_{};
  Options options_{};
  Applied applied_{};
  ExposureSetting in_force_{};               // what the camera's registers hold; under device_
  bool configured_ = false, stale_ = false;  // stale: the camera may hold what was refused
  std::unique_ptr<Arena> arena_;
  std::span<std::uint8_t> pixels_,
      wire_;  // slots; transport's buffers where they are not the slots
  std::size_t slot_bytes_ = 0, wire_bytes_ = 0, slots_ = 0, stride_ = 0;
  std::vector<ArvBuffer*> buffers_;
  bool converting_ = false;

  Handover handover_;

  // Of Aravis's thread while a stream is open.
  ArvStream* stream_ = nullptr;
  BlockCounter blocks_;
  exposure::AppliedExposure exposures_;
  Duration exposure_now_{};      // of the last frame
  std::vector<FrameSlot> free_;  // converting: slots that are the transport's
  std::atomic<std::int64_t> heard_ns_{0};
  std::atomic<int> wrong_sizes_{0};  // in a row
  std::atomic<int> seen_width_{0}, seen_height_{0};
  std::atomic<std::uint64_t> untold_{
      0};  // whole frames since configure() whose chunk data did not have the exposure

  std::mutex supervisor_;
  std::condition_variable wake_;
  bool quit_ = false;
  std::thread supervising_;
};

}  // namespace vergence::gige
