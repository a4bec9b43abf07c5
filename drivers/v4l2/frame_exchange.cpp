#include "drivers/v4l2/frame_exchange.hpp"

#include <utility>

namespace vergence::v4l2 {

// ---- the owner

bool FrameExchange::busy() const noexcept {
  const std::lock_guard lock(mutex_);
  return queue_.started() || slots_.held() > 0;
}

void FrameExchange::use_buffers(int width, int height, std::size_t stride) {
  const std::lock_guard lock(mutex_);
  slots_.use_buffers(width, height, stride);
}

void FrameExchange::use_pool(int width, int height) {
  const std::lock_guard lock(mutex_);
  slots_.use_pool(width, height);
}

void FrameExchange::install(std::vector<Mapping> mappings) {
  const std::lock_guard lock(mutex_);
  slots_.install(std::move(mappings));
}

FrameExchange::Buffers FrameExchange::free_buffers() noexcept {
  const std::lock_guard lock(mutex_);
  returned_.count = 0;
  Buffers free;
  for (std::uint32_t i = 0; i < slots_.buffers(); ++i)
    if (slots_.may_enqueue(i)) free.index[free.count++] = i;
  return free;
}

void FrameExchange::begin(Notifier* ready, Duration silence) noexcept {
  {
    const std::lock_guard lock(mutex_);
    node_died_ = false;
  }
  queue_.begin(ready, silence);
  queue_.count_start();
}

bool FrameExchange::drain() noexcept {
  const std::lock_guard lock(mutex_);
  for (FrameSlot slot = 0; queue_.drain(&slot);) (void)slots_.release(slot);
  return node_died_;
}

// ---- any thread

DeviceStatus FrameExchange::standing() const noexcept {
  switch (queue_.state()) {
    case FrameQueue::State::stopped:
      return DeviceStatus::stopped;
    case FrameQueue::State::streaming:
      return DeviceStatus::ok;
    default:
      return DeviceStatus::gone;
  }
}

// ---- the releaser

bool FrameExchange::release(FrameSlot slot) noexcept {
  const std::lock_guard lock(mutex_);
  (void)queue_.release(slot);  // before it is free to be offered again
  const std::optional<std::uint32_t> buffer = slots_.release(slot);
  if (buffer)
    returned_.index[returned_.count++] = *buffer;  // while stopped start() finds it by itself
  return buffer.has_value();
}

// ---- the capture thread

FrameExchange::Buffers FrameExchange::take_returned() noexcept {
  const std::lock_guard lock(mutex_);
  const Buffers taken = returned_;
  returned_.count = 0;
  return taken;
}

/// Precondition: mutex_ held.
std::optional<FrameSlot> FrameExchange::counted(std::optional<FrameSlot> slot) noexcept {
  if (!slot) queue_.count_underrun();
  return slot;
}

std::optional<FrameSlot> FrameExchange::hold_buffer(std::uint32_t index, std::size_t offset,
                                                    std::size_t with_kernel) noexcept {
  const std::lock_guard lock(mutex_);
  if (with_kernel < kBufferReserve) return counted(std::nullopt);
  return slots_.hold_buffer(index, offset);
}

std::optional<FrameSlot> FrameExchange::hold_pooled() noexcept {
  const std::lock_guard lock(mutex_);
  return counted(slots_.hold_pooled());
}

void FrameExchange::offer(const Frame& frame) noexcept {
  if (queue_.offer(frame)) return;
  const std::lock_guard lock(mutex_);
  (void)slots_.release(frame.slot);  // its buffer: start() finds it by itself
}

void FrameExchange::note_dead_node() noexcept {
  const std::lock_guard lock(mutex_);
  node_died_ = true;
}

}  // namespace vergence::v4l2
