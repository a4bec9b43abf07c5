#pragma once
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/common/frame_queue.hpp"
#include "drivers/exposure/applied_exposure.hpp"
#include "drivers/gige/detail/image_memory.hpp"
#include "drivers/gige/detail/session.hpp"
#include "drivers/gige/detail/slot_returns.hpp"

namespace vergence::gige {

/// Block ids of a stream, 16 or 64 bit, into exposures since its first frame.
///
/// 16-bit ids are never 0: after 65535 comes 1. A 64-bit id shows itself by its size; until then
/// both count alike.
/// Not thread-safe. Fixed memory.
class BlockCounter {
 public:
  struct Step {
    std::uint64_t counter = 0;
    std::uint64_t missing = 0;  // exposures between the newest before and this one
  };
  /// Nothing: an id of 0, or one that is not newer than the newest (late or sent twice).
  [[nodiscard]] std::optional<Step> next(std::uint64_t id) noexcept {
    constexpr std::int64_t kIds = 65535;
    if (id == 0) return std::nullopt;
    if (!any_) {
      any_ = true;
      wide_ = id > static_cast<std::uint64_t>(kIds);
      newest_ = id;
      return Step{0, 0};
    }
    wide_ = wide_ || id > static_cast<std::uint64_t>(kIds);
    auto ahead = static_cast<std::int64_t>(id - newest_);
    if (!wide_) {  // the nearest of the ids that look like this one
      ahead %= kIds;
      if (ahead > kIds / 2) ahead -= kIds;
      if (ahead < -(kIds / 2)) ahead += kIds;
    }
    if (ahead <= 0) return std::nullopt;
    newest_ = id;
    counter_ += static_cast<std::uint64_t>(ahead);
    return Step{counter_, static_cast<std::uint64_t>(ahead) - 1};
  }
  void restart() noexcept { *this = BlockCounter{}; }

 private:
  bool any_ = false, wide_ = false;
  std::uint64_t newest_ = 0, counter_ = 0;
};

/// Callback of Aravis's receive thread: completed buffers become frames with number, time,
/// exposure and state, and go to the FrameQueue; slots that come back go to the transport again.
///
/// Threads  begin(), supply_buffers(), end(): the owner, while no callback can come. callback():
///          Aravis's thread, vergence-gige. The others: any.
/// Memory   Taken by begin().
/// Errors   A frame of another size than configured is torn, and counted.
class FrameReceiver {
 public:
  /// All outlive the receiver.
  FrameReceiver(FrameQueue& queue, SlotReturns& slots, ImageMemory& memory)
      : queue_(queue), slots_(slots), memory_(memory) {}

  /// Callback for Session::open_stream(); `self` is a FrameReceiver.
  static void callback(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);

  /// A stream of the session was opened. `applied` is its configuration, `exposure` what the
  /// camera's registers hold; both are constant, `session` is there, until end().
  void begin(Session& session, const Applied& applied, int width, int height,
             const ExposureSetting& exposure);
  /// Gives the transport every buffer whose slot is not with the consumer.
  void supply_buffers();
  /// The stream was closed: no callback comes any more.
  void end() noexcept { session_ = nullptr; }

  /// The camera's registers hold this from now on.
  void change_exposure(const ExposureSetting& setting) noexcept;

  /// Time of the newest buffer, or of begin().
  [[nodiscard]] HostStamp last_buffer() const noexcept {
    return HostStamp(last_buffer_ns_.load(std::memory_order_acquire));
  }
  /// Frames in a row whose size is not the configured one.
  [[nodiscard]] int wrong_sizes() const noexcept {
    return wrong_sizes_.load(std::memory_order_relaxed);
  }
  /// Value of the newest of these; 0 if unknown.
  [[nodiscard]] int wrong_width() const noexcept {
    return wrong_width_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] int wrong_height() const noexcept {
    return wrong_height_.load(std::memory_order_relaxed);
  }

 private:
  void take(ArvBuffer* buffer) noexcept;
  [[nodiscard]] bool describe(ArvBuffer* buffer, HostStamp arrival, Frame* frame) noexcept;
  [[nodiscard]] bool right_size(ArvBuffer* buffer) noexcept;
  void recycle() noexcept;

  FrameQueue& queue_;
  SlotReturns& slots_;
  ImageMemory& memory_;
  Session* session_ = nullptr;
  const Applied* applied_ = nullptr;
  int width_ = 0, height_ = 0;
  BlockCounter blocks_;
  exposure::AppliedExposure exposures_;
  Duration last_exposure_{};     // of the last frame
  std::vector<FrameSlot> free_;  // converting: slots that are the transport's
  std::atomic<std::int64_t> last_buffer_ns_{0};
  std::atomic<int> wrong_sizes_{0}, wrong_width_{0}, wrong_height_{0};
};

}  // namespace vergence::gige
