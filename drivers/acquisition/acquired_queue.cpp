#include "drivers/acquisition/acquired_queue.hpp"

#include <algorithm>

namespace vergence {

void AcquiredQueue::push(const Item& item) noexcept {
  if (std::holds_alternative<AcquiredFrame>(item)) waiting_.fetch_add(1, std::memory_order_acq_rel);
  for (;;) {
    const WakeEvent::Ticket seen = freed_.ticket();
    if (ring_.push(item)) break;
    if (stopped_.load(std::memory_order_acquire)) return;
    if (!wait_when_full_ && std::holds_alternative<InsRecord>(item)) {
      dropped_readings_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    // Waits with images; meanwhile the cameras drop and count frames.
    freed_.wait(seen);
  }
  high_water_.store(std::max(high_water_.load(std::memory_order_relaxed), ring_.size()),
                    std::memory_order_relaxed);
  filled_.signal();
}

void AcquiredQueue::finish() noexcept {
  finished_.store(true, std::memory_order_release);
  filled_.signal();
}

void AcquiredQueue::stop() noexcept {
  stopped_.store(true, std::memory_order_release);
  filled_.signal();
  freed_.signal();
}

bool AcquiredQueue::next(Acquired* out) noexcept {
  for (Item item;;) {
    const WakeEvent::Ticket seen = filled_.ticket();
    // Read before the ring, so that items pushed earlier are still found.
    const bool finished = finished_.load(std::memory_order_acquire);
    if (!ring_.pop(&item)) {
      if (finished) return false;
      filled_.wait(seen);
      continue;
    }
    freed_.signal();
    if (const auto* reading = std::get_if<InsRecord>(&item)) {
      *out = *reading;
      return true;
    }
    if (const auto* event = std::get_if<DeviceEvent>(&item)) {
      *out = *event;
      return true;
    }
    if (const auto* refused = std::get_if<Refused>(&item)) {
      release(refused->set);
      continue;
    }
    auto* frame = std::get_if<AcquiredFrame>(&item);
    const int behind = waiting_.fetch_sub(1, std::memory_order_acq_rel) - 1;
    if (!wait_when_full_ && behind >= kMaxWaiting) {
      release(frame->set);
      skipped_sets_.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    for (std::size_t k = 0; k < cameras_.size(); ++k)
      if (frame->set.present[k]) frame->rig.images[k] = cameras_[k]->view(frame->set.slots[k]);
    *out = *frame;
    return true;
  }
}

void AcquiredQueue::release(const SyncedSet& set) noexcept {
  for (std::size_t k = 0; k < cameras_.size(); ++k)
    if (set.present[k]) cameras_[k]->release(set.slots[k]);
}

}  // namespace vergence
