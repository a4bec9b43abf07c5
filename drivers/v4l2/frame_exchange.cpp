#include "drivers/v4l2/frame_exchange.hpp"

#include <chrono>
#include <utility>

namespace vergence::v4l2 {

// ---- the owner

bool FrameExchange::busy() const noexcept {
  const std::lock_guard lock(mutex_);
  return streaming_ || slots_.held() > 0;
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

void FrameExchange::begin(Notifier* ready) noexcept {
  const std::lock_guard lock(mutex_);
  notifier_ = ready;
  streaming_ = true;
  gone_ = node_died_ = false;
  ++statistics_.starts;
}

void FrameExchange::abort() noexcept {
  const std::lock_guard lock(mutex_);
  streaming_ = false;
}

void FrameExchange::end() noexcept {
  {
    const std::lock_guard lock(mutex_);
    streaming_ = false;
    gone_ = false;
  }
  changed_.notify_all();
}

bool FrameExchange::drain() noexcept {
  const std::lock_guard lock(mutex_);
  for (; ready_count_ > 0; --ready_count_, ready_first_ = (ready_first_ + 1) % ready_.size())
    (void)slots_.release(ready_[ready_first_].slot);
  return node_died_;
}

// ---- any thread

bool FrameExchange::streaming() const noexcept {
  const std::lock_guard lock(mutex_);
  return streaming_;
}

DeviceStatus FrameExchange::standing() const noexcept {
  const std::lock_guard lock(mutex_);
  if (!streaming_) return DeviceStatus::stopped;
  return gone_ ? DeviceStatus::gone : DeviceStatus::ok;
}

CameraStatistics FrameExchange::statistics() const noexcept {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

// ---- the consumer and the releaser

DeviceStatus FrameExchange::wait(Duration limit, Frame* frame) noexcept {
  std::unique_lock lock(mutex_);
  if (!streaming_) return DeviceStatus::stopped;
  const auto something = [this] { return ready_count_ > 0 || gone_ || !streaming_; };
  if (!something() && limit > Duration{})
    (void)changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()), something);
  if (!streaming_) return DeviceStatus::stopped;
  if (ready_count_ > 0) {
    *frame = ready_[ready_first_];
    ready_first_ = (ready_first_ + 1) % ready_.size();
    --ready_count_;
    ++statistics_.delivered;
    if (frame->status == FrameStatus::torn) ++statistics_.torn;
    return DeviceStatus::ok;
  }
  if (!gone_) return DeviceStatus::timeout;
  frame->arrival = gone_at_;
  return DeviceStatus::gone;
}

bool FrameExchange::release(FrameSlot slot) noexcept {
  const std::lock_guard lock(mutex_);
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

void FrameExchange::count_lost(std::uint64_t exposures) noexcept {
  const std::lock_guard lock(mutex_);
  statistics_.lost += exposures;
}

/// Precondition: mutex_ held.
std::optional<FrameSlot> FrameExchange::counted(std::optional<FrameSlot> slot) noexcept {
  if (!slot) ++statistics_.underruns;
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
  {
    const std::lock_guard lock(mutex_);
    ready_[(ready_first_ + ready_count_) % ready_.size()] = frame;
    ++ready_count_;
  }
  changed_.notify_one();
  if (notifier_ != nullptr) notifier_->notify();
}

void FrameExchange::note_dead_node() noexcept {
  const std::lock_guard lock(mutex_);
  node_died_ = true;
}

void FrameExchange::lose(HostStamp when) noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_) return;
    gone_ = true;
    gone_at_ = when;
  }
  changed_.notify_all();
  if (notifier_ != nullptr) notifier_->notify();
}

}  // namespace vergence::v4l2
