#include "drivers/gige/detail/handover.hpp"

#include <cassert>
#include <chrono>

namespace vergence::gige {

void Handover::set_slots(std::size_t slots, std::size_t most) {
  const std::lock_guard lock(mutex_);
  assert(slots <= FramePool::kMaxSlots && most <= slots);
  slots_ = slots;
  most_ = most;
  out_ = first_ = offered_ = returned_count_ = 0;
  where_.fill(Where::transport);
}

bool Handover::any_out() const {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < slots_; ++i)
    if (where_[i] == Where::consumer) return true;
  return false;
}

void Handover::begin(Notifier* ready) {
  const std::lock_guard lock(mutex_);
  while (offered_ > 0) {
    where_[frames_[first_].slot] = Where::transport;
    first_ = (first_ + 1) % frames_.size();
    --offered_;
    --out_;
  }
  for (std::size_t i = 0; i < slots_; ++i)
    if (where_[i] == Where::returned) where_[i] = Where::transport;
  returned_count_ = 0;
  notifier_ = ready;
  state_ = State::streaming;
}

void Handover::count_start() {
  const std::lock_guard lock(mutex_);
  ++statistics_.starts;
}

void Handover::fail(HostStamp when) {
  const std::lock_guard lock(mutex_);
  state_ = State::gone;
  lost_at_ = when;
}

void Handover::end() {
  const std::lock_guard lock(mutex_);
  state_ = State::stopped;
  notifier_ = nullptr;
  changed_.notify_all();
}

DeviceStatus Handover::wait(Duration limit, Frame* frame) {
  std::unique_lock lock(mutex_);
  if (limit > Duration{})
    (void)changed_.wait_for(lock, std::chrono::nanoseconds(limit.ns()),
                            [this] { return offered_ > 0 || state_ != State::streaming; });
  if (state_ == State::stopped) return DeviceStatus::stopped;
  if (offered_ > 0) {
    *frame = frames_[first_];
    first_ = (first_ + 1) % frames_.size();
    --offered_;
    where_[frame->slot] = Where::consumer;
    ++statistics_.delivered;
    if (frame->status != FrameStatus::complete) ++statistics_.torn;
    return DeviceStatus::ok;
  }
  if (state_ == State::streaming) return DeviceStatus::timeout;
  frame->arrival = lost_at_;
  return DeviceStatus::gone;
}

void Handover::release(FrameSlot slot) {
  const std::lock_guard lock(mutex_);
  assert(slot < slots_ && where_[slot] == Where::consumer);
  where_[slot] = Where::returned;
  returned_[returned_count_++] = slot;
  --out_;
}

bool Handover::offer(const Frame& frame) {
  const std::lock_guard lock(mutex_);
  if (state_ != State::streaming) return false;
  if (out_ >= most_) {
    ++statistics_.underruns;
    return false;
  }
  ++out_;
  frames_[(first_ + offered_++) % frames_.size()] = frame;
  where_[frame.slot] = Where::offered;
  changed_.notify_all();
  if (notifier_ != nullptr) notifier_->notify();
  return true;
}

bool Handover::returned(FrameSlot* slot) {
  const std::lock_guard lock(mutex_);
  if (returned_count_ == 0) return false;
  *slot = returned_[--returned_count_];
  where_[*slot] = Where::transport;
  return true;
}

bool Handover::is_out(FrameSlot slot) const {
  const std::lock_guard lock(mutex_);
  return where_[slot] != Where::transport;
}

void Handover::count_lost(std::uint64_t exposures) {
  const std::lock_guard lock(mutex_);
  statistics_.lost += exposures;
}

void Handover::lose(HostStamp when) {
  const std::lock_guard lock(mutex_);
  if (state_ != State::streaming) return;
  state_ = State::gone;
  lost_at_ = when;
  changed_.notify_all();
  if (notifier_ != nullptr) notifier_->notify();
}

void Handover::ready_again() {
  const std::lock_guard lock(mutex_);
  if (state_ == State::gone) state_ = State::back;
  if (state_ == State::back && notifier_ != nullptr) notifier_->notify();
}

Handover::State Handover::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

CameraStatistics Handover::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace vergence::gige
