#include "drivers/common/frame_queue.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <chrono>

#include "drivers/clock.hpp"

namespace vergence {
namespace {

static_assert(FramePool::kMaxSlots <= 64, "a bit a slot");

constexpr std::uint64_t bit(FrameSlot slot) noexcept { return std::uint64_t{1} << slot; }

}  // namespace

Duration longest_silence(CameraTrigger trigger, double rate_hz) noexcept {
  constexpr Duration kMin = Duration::seconds(2);
  if (trigger != CameraTrigger::free || !(rate_hz > 0)) return {};
  return std::max(kMin, Duration::seconds(10 / rate_hz));
}

void FrameQueue::begin(Notifier* ready, Duration silence) noexcept {
  const std::lock_guard lock(mutex_);
  notifier_ = ready;
  silence_ = silence;
  heard_any_ = false;
  heard_ = asked_ = monotonic_now();
  state_ = State::streaming;
}

void FrameQueue::end() noexcept {
  const std::lock_guard lock(mutex_);
  state_ = State::stopped;
  notifier_ = nullptr;
  changed_.notify_all();
}

void FrameQueue::fail(HostStamp when) noexcept {
  const std::lock_guard lock(mutex_);
  state_ = State::disconnected;
  disconnected_at_ = when;
}

void FrameQueue::fail() noexcept {
  const std::lock_guard lock(mutex_);
  state_ = State::disconnected;
}

bool FrameQueue::drain(FrameSlot* slot) noexcept {
  const std::lock_guard lock(mutex_);
  if (offered_ == 0) return false;
  *slot = frames_[first_].slot;
  first_ = (first_ + 1) % frames_.size();
  --offered_;
  offered_slots_ &= ~bit(*slot);
  return true;
}

void FrameQueue::count_start() noexcept {
  const std::lock_guard lock(mutex_);
  ++statistics_.starts;
}

bool FrameQueue::offer(const Frame& frame) noexcept {
  const std::lock_guard lock(mutex_);
  assert(((offered_slots_ | held_slots_) & bit(frame.slot)) == 0);
  hear();
  if (state_ != State::streaming || offered_ == frames_.size()) return false;
  frames_[(first_ + offered_++) % frames_.size()] = frame;
  offered_slots_ |= bit(frame.slot);
  changed_.notify_all();
  if (notifier_ != nullptr) notifier_->notify();
  return true;
}

void FrameQueue::count_lost(std::uint64_t exposures) noexcept {
  const std::lock_guard lock(mutex_);
  statistics_.lost += exposures;
}

void FrameQueue::count_underrun() noexcept {
  const std::lock_guard lock(mutex_);
  ++statistics_.underruns;
  hear();
}

void FrameQueue::lose(HostStamp when) noexcept {
  const std::lock_guard lock(mutex_);
  if (state_ != State::streaming) return;
  state_ = State::disconnected;
  disconnected_at_ = when;
  changed_.notify_all();
  if (notifier_ != nullptr) notifier_->notify();
}

void FrameQueue::ready_again() noexcept {
  const std::lock_guard lock(mutex_);
  if (state_ == State::disconnected) state_ = State::reconnected;
  if (state_ == State::reconnected && notifier_ != nullptr) notifier_->notify();
}

void FrameQueue::hear() noexcept {
  heard_any_ = true;
  if (silence_ > Duration{}) heard_ = monotonic_now();
}

bool FrameQueue::silent(HostStamp now) const noexcept {
  if (silence_ <= Duration{}) return false;
  return now - heard_ > (heard_any_ ? silence_ : std::max(silence_, kFirstImage));
}

DeviceStatus FrameQueue::wait(Duration limit, Frame* frame) noexcept {
  std::unique_lock lock(mutex_);
  if (const HostStamp now = monotonic_now(); now - asked_ > kAway) heard_ = now;
  const DeviceStatus status = wait_locked(&lock, limit, frame);
  asked_ = monotonic_now();
  return status;
}

DeviceStatus FrameQueue::wait_locked(std::unique_lock<std::mutex>* lock, Duration limit,
                                     Frame* frame) noexcept {
  if (limit > Duration{})
    (void)changed_.wait_for(*lock, std::chrono::nanoseconds(limit.ns()),
                            [this] { return offered_ > 0 || state_ != State::streaming; });
  if (state_ == State::stopped) return DeviceStatus::stopped;
  if (offered_ > 0) {
    *frame = frames_[first_];
    first_ = (first_ + 1) % frames_.size();
    --offered_;
    offered_slots_ &= ~bit(frame->slot);
    held_slots_ |= bit(frame->slot);
    ++statistics_.delivered;
    if (frame->status != FrameStatus::complete) ++statistics_.incomplete;
    return DeviceStatus::ok;
  }
  if (const HostStamp now = monotonic_now(); state_ == State::streaming && silent(now)) {
    state_ = State::disconnected;
    disconnected_at_ = now;
  }
  if (state_ == State::streaming) return DeviceStatus::timeout;
  frame->arrival = disconnected_at_;
  return DeviceStatus::disconnected;
}

bool FrameQueue::release(FrameSlot slot) noexcept {
  const std::lock_guard lock(mutex_);
  const bool held = (held_slots_ & bit(slot)) != 0;
  held_slots_ &= ~bit(slot);
  return held;
}

FrameQueue::State FrameQueue::state() const noexcept {
  const std::lock_guard lock(mutex_);
  return state_;
}

DeviceStatus FrameQueue::standing() const noexcept {
  const State now = state();
  return now == State::streaming ? DeviceStatus::ok
         : now == State::stopped ? DeviceStatus::stopped
                                 : DeviceStatus::disconnected;
}

std::size_t FrameQueue::held() const noexcept {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::popcount(held_slots_));
}

std::size_t FrameQueue::out() const noexcept {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::popcount(offered_slots_ | held_slots_));
}

bool FrameQueue::is_out(FrameSlot slot) const noexcept {
  const std::lock_guard lock(mutex_);
  return ((offered_slots_ | held_slots_) & bit(slot)) != 0;
}

CameraStatistics FrameQueue::statistics() const noexcept {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace vergence
