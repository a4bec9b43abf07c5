#pragma once
#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/v4l2/slots.hpp"

namespace vergence::v4l2 {

inline constexpr std::size_t kBufferReserve =
    2;  // the kernel always has: with none it drops frames, and nobody knows how many

/// Between the capture thread and the camera's users: frames one way, buffers back, and what state
/// the stream is in.
///
/// Threads  Each call by whom its comment names. One mutex, held for a few assignments only, never
///          across a system call.
/// Memory   Fixed, but for the slots (Slots). Full: the newest frame is refused and counted as an
///          underrun.
class FrameExchange {
 public:
  /// Buffers for the kernel.
  struct Buffers {
    std::array<std::uint32_t, Slots::kMost> index{};
    std::size_t count = 0;
    [[nodiscard]] std::span<const std::uint32_t> list() const noexcept {
      return std::span(index).first(count);
    }
  };

  // The owner.
  /// Streams, or images are in use.
  [[nodiscard]] bool busy() const noexcept;
  /// Grey in the kernel's buffers, as they come; or converted from them. Precondition: not busy.
  void use_buffers(int width, int height, std::size_t stride);
  void use_pool(int width, int height);
  /// New buffers from the kernel; those before are nobody's.
  void install(std::vector<Mapping> mappings);
  /// Precondition: no capture thread runs. All that the kernel may have now.
  [[nodiscard]] Buffers free_buffers() noexcept;
  /// It streams: one start more.
  void begin(Notifier* ready) noexcept;
  /// It does not after all.
  void abort() noexcept;
  /// Those who wait are woken.
  void end() noexcept;
  /// After the capture thread's end: what nobody took is free again. True: the node has died.
  [[nodiscard]] bool drain() noexcept;

  // Any thread.
  [[nodiscard]] bool streaming() const noexcept;
  /// → ok (it streams), stopped, gone
  [[nodiscard]] DeviceStatus standing() const noexcept;
  [[nodiscard]] ImageView view(FrameSlot slot) const noexcept { return slots_.view(slot); }
  [[nodiscard]] CameraStatistics statistics() const noexcept;

  // The consumer.
  [[nodiscard]] DeviceStatus wait(Duration limit, Frame* frame) noexcept;
  // The releaser.
  /// True: a buffer is free by it, for the capture thread.
  [[nodiscard]] bool release(FrameSlot slot) noexcept;

  // The capture thread.
  [[nodiscard]] Buffers take_returned() noexcept;
  /// Constant while it streams, as are the buffers.
  [[nodiscard]] const Slots& slots() const noexcept { return slots_; }
  [[nodiscard]] std::span<std::uint8_t> writable(FrameSlot slot) noexcept {
    return slots_.writable(slot);
  }
  void count_lost(std::uint64_t exposures) noexcept;
  /// The slot that a filled buffer is, its first pixel at `offset`; nothing: the kernel, which has
  /// `with_kernel` beside it, would have too few. Precondition: slots().in_place().
  [[nodiscard]] std::optional<FrameSlot> hold_buffer(std::uint32_t index, std::size_t offset,
                                                     std::size_t with_kernel) noexcept;
  /// A slot to convert into; nothing: all are out. Precondition: not slots().in_place().
  [[nodiscard]] std::optional<FrameSlot> hold_pooled() noexcept;
  /// Of a slot that is held.
  void offer(const Frame& frame) noexcept;
  void note_dead_node() noexcept;
  /// From streaming: the camera is gone. Nothing happens where it was stopped.
  void lose(HostStamp when) noexcept;

 private:
  [[nodiscard]] std::optional<FrameSlot> counted(std::optional<FrameSlot> slot) noexcept;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Notifier* notifier_ = nullptr;  // constant while streaming
  Slots slots_;
  std::array<Frame, Slots::kMost> ready_{};
  std::size_t ready_first_ = 0, ready_count_ = 0;
  Buffers returned_{};
  bool streaming_ = false, gone_ = false, node_died_ = false;
  HostStamp gone_at_{};
  CameraStatistics statistics_{};
};

}  // namespace vergence::v4l2
