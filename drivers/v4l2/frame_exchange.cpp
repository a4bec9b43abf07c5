#include "drivers/v4l2/frame_exchange.hpp"

#include <cassert>
#include <utility>

namespace vergence::v4l2 {

namespace {

constexpr std::uint16_t kNone = 0xFFFF;

}  // namespace

void Slots::use_buffers(int width, int height, std::size_t stride) {
  assert(held_ == 0);
  install({});
  pool_.reset();
  arena_.reset();
  width_ = width;
  height_ = height;
  stride_ = stride;
}

void Slots::use_pool(int width, int height) {
  assert(held_ == 0);
  install({});
  auto arena = std::make_unique<Arena>();
  pool_ = std::make_unique<FramePool>(width, height, kPool, *arena);
  arena_ = std::move(arena);
  width_ = width;
  height_ = height;
}

void Slots::install(std::vector<Mapping> mappings) {
  for (Entry& e : entries_) {
    e.current = false;
    if (!e.held) e = Entry{};
  }
  raw_.clear();
  buffer_slots_.assign(mappings.size(), kNone);
  if (!in_place()) {
    raw_ = std::move(mappings);
    return;
  }
  std::size_t at = 0;
  for (std::size_t i = 0; i < mappings.size(); ++i) {
    while (at < kMax && entries_[at].used) ++at;
    if (at == kMax) return;
    entries_[at].memory = std::move(mappings[i]);
    entries_[at].used = entries_[at].current = true;
    entries_[at].buffer = static_cast<std::uint32_t>(i);
    buffer_slots_[i] = static_cast<std::uint16_t>(at);
  }
}

std::span<const std::uint8_t> Slots::buffer(std::uint32_t index) const noexcept {
  const Mapping& m = in_place() ? entries_[buffer_slots_[index]].memory : raw_[index];
  return {m.data(), m.bytes()};
}

bool Slots::may_enqueue(std::uint32_t index) const noexcept {
  if (!in_place()) return true;
  return buffer_slots_[index] != kNone && !entries_[buffer_slots_[index]].held;
}

FrameSlot Slots::hold_buffer(std::uint32_t index, std::size_t offset) noexcept {
  Entry& e = entries_[buffer_slots_[index]];
  assert(!e.held);
  e.held = true;
  e.offset = offset;
  ++held_;
  return buffer_slots_[index];
}

std::optional<FrameSlot> Slots::hold_pooled() noexcept {
  const std::optional<FrameSlot> slot = pool_->acquire();
  if (slot) ++held_;
  return slot;
}

std::optional<std::uint32_t> Slots::release(FrameSlot slot) noexcept {
  if (!in_place()) {
    if (pool_->release(slot)) --held_;
    return std::nullopt;
  }
  --held_;
  Entry& e = entries_[slot];
  assert(e.held);
  e.held = false;
  if (e.current) return e.buffer;
  e = Entry{};
  return std::nullopt;
}

ImageView Slots::view(FrameSlot slot) const noexcept {
  if (!in_place()) return pool_->view(slot);
  return {entries_[slot].memory.data() + entries_[slot].offset, width_, height_,
          static_cast<std::ptrdiff_t>(stride_)};
}

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

// ---- the releaser

bool FrameExchange::release(FrameSlot slot) noexcept {
  const std::lock_guard lock(mutex_);
  // The queue releases the slot before it is free to be offered again.
  (void)queue_.release(slot);
  const std::optional<std::uint32_t> buffer = slots_.release(slot);
  // While stopped, the list is ignored: start() finds free buffers itself.
  if (buffer) returned_.index[returned_.count++] = *buffer;
  return buffer.has_value();
}

// ---- the capture thread

FrameExchange::Buffers FrameExchange::pop_returned() noexcept {
  const std::lock_guard lock(mutex_);
  const Buffers returned = returned_;
  returned_.count = 0;
  return returned;
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
  // While stopped, start() finds the freed buffer itself.
  (void)slots_.release(frame.slot);
}

void FrameExchange::record_dead_node() noexcept {
  const std::lock_guard lock(mutex_);
  node_died_ = true;
}

}  // namespace vergence::v4l2
