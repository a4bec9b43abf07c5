#include "drivers/v4l2/slots.hpp"

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
  auto arena = std::make_unique<Arena>(FramePool::memory_needed(width, height, kPool) + kCacheLine);
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
    while (at < kMost && entries_[at].used) ++at;
    if (at == kMost) return;
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

}  // namespace vergence::v4l2
