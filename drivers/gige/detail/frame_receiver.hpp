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

/// Unwraps the block ids of a stream (16 or 64 bit) into a count of exposures since its first
/// frame.
///
/// 16-bit ids skip 0: 65535 is followed by 1. Ids count as 64 bit once one exceeds 65535. Not
/// thread-safe.
class BlockCounter {
 public:
  struct Step {
    std::uint64_t counter = 0;
    /// Exposures missing between the previous newest id and this one.
    std::uint64_t missing = 0;
  };
  /// Returns nothing for an id of 0 and for an id that is not newer than the newest (late or
  /// duplicate).
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
    if (!wide_) {
      // Takes the value congruent to this 16-bit id that is nearest to the newest one.
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

/// Turns Aravis's completed buffers into frames with number, time, exposure and status, puts them
/// into the FrameQueue, and returns released slots to the transport.
///
/// Threads  The owner calls begin(), supply_buffers() and end() while no callback can run.
///          callback() runs on Aravis's thread. The other functions are thread-safe.
/// Memory   Allocated by begin().
/// Errors   A frame whose size is not the configured one is incomplete and counted.
class FrameReceiver {
 public:
  /// All arguments must outlive the receiver.
  FrameReceiver(FrameQueue& queue, SlotReturns& slots, ImageMemory& memory)
      : queue_(queue), slots_(slots), memory_(memory) {}

  /// Callback for Session::open_stream(); `self` is a FrameReceiver.
  static void callback(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);

  /// Called after a stream of the session was opened. `applied` is its configuration, `exposure`
  /// the setting in the camera's registers. `applied` and `session` must stay valid until end().
  void begin(Session& session, const Applied& applied, int width, int height,
             const ExposureSetting& exposure);
  /// Gives the transport every buffer whose slot is not held by the consumer.
  void supply_buffers();
  /// Called after the stream was closed, when no further callback can run.
  void end() noexcept { session_ = nullptr; }

  /// Reports that the camera's registers now hold this setting.
  void change_exposure(const ExposureSetting& setting) noexcept;

  /// Time of the newest buffer, or of begin() before the first one.
  [[nodiscard]] HostStamp last_buffer() const noexcept {
    return HostStamp(last_buffer_ns_.load(std::memory_order_acquire));
  }
  /// Number of consecutive frames whose size is not the configured one.
  [[nodiscard]] int wrong_sizes() const noexcept {
    return wrong_sizes_.load(std::memory_order_relaxed);
  }
  /// Size of the newest of these frames; 0 if unknown.
  [[nodiscard]] int wrong_width() const noexcept {
    return wrong_width_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] int wrong_height() const noexcept {
    return wrong_height_.load(std::memory_order_relaxed);
  }

 private:
  void receive(ArvBuffer* buffer) noexcept;
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
  // Exposure time of the last frame.
  Duration last_exposure_{};
  // Slots that belong to the transport; used only when images are converted.
  std::vector<FrameSlot> free_;
  std::atomic<std::int64_t> last_buffer_ns_{0};
  std::atomic<int> wrong_sizes_{0}, wrong_width_{0}, wrong_height_{0};
};

}  // namespace vergence::gige
