#include "drivers/gige/detail/slot_returns.hpp"

#include <algorithm>

namespace vergence::gige {

void SlotReturns::set_limit(std::size_t most) noexcept {
  take_back();
  const std::lock_guard lock(mutex_);
  most_ = most;
}

void SlotReturns::take_back() noexcept {
  const std::lock_guard lock(mutex_);
  for (FrameSlot slot = 0; queue_.drain(&slot);) {
  }
  returned_count_ = 0;
}

void SlotReturns::release(FrameSlot slot) noexcept {
  const std::lock_guard lock(mutex_);
  if (queue_.release(slot)) returned_[returned_count_++] = slot;
}

bool SlotReturns::offer(const Frame& frame) noexcept {
  if (queue_.state() != FrameQueue::State::streaming) return false;
  if (queue_.out() >= most_) {
    queue_.count_underrun();
    return false;
  }
  return queue_.offer(frame);
}

bool SlotReturns::returned(FrameSlot* slot) noexcept {
  const std::lock_guard lock(mutex_);
  if (returned_count_ == 0) return false;
  *slot = returned_[--returned_count_];
  return true;
}

bool SlotReturns::is_out(FrameSlot slot) const noexcept {
  const std::lock_guard lock(mutex_);
  const auto* end = returned_.data() + returned_count_;
  return queue_.is_out(slot) || std::find(returned_.data(), end, slot) != end;
}

}  // namespace vergence::gige
