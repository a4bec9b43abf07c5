#include "drivers/mock/detail/delivery_queue.hpp"

#include <pthread.h>

#include <chrono>
#include <mutex>

#include "drivers/clock.hpp"

namespace vergence::mock {

void DeliveryQueue::begin() {
  finished_ = false;
  if (rig_.options.real_time) deliverer_ = std::thread([this] { hand_out_in_time(); });
}

void DeliveryQueue::join() noexcept {
  { const std::lock_guard lock(mutex_); }
  posted_.notify_all();
  if (deliverer_.joinable()) deliverer_.join();
}

void DeliveryQueue::finish(HostStamp at) {
  for (int device = kTriggerDevice; device < static_cast<int>(cameras_.size()); ++device) {
    QueuedDelivery p;
    p.device = device;
    p.arrival = at;
    p.frame.what = Delivery<Frame>::What::end;
    p.reading.what = Delivery<InsReading>::What::end;
    p.report.what = Delivery<BoardReport>::What::end;
    post(p);
  }
  if (!rig_.options.real_time) {
    deliver_until(HostStamp(INT64_MAX));
  } else {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    posted_.notify_all();
  }
}

std::optional<FrameSlot> DeliveryQueue::pop_spare(int k) {
  const std::lock_guard lock(mutex_);
  Sender& sender = senders_[static_cast<std::size_t>(k)];
  if (sender.spare.empty()) return std::nullopt;
  const FrameSlot slot = sender.spare.back();
  sender.spare.pop_back();
  return slot;
}

void DeliveryQueue::post(QueuedDelivery parcel) {
  if (parcel.device >= 0 && parcel.frame.what == Delivery<Frame>::What::item)
    senders_[static_cast<std::size_t>(parcel.device)].on_the_way.fetch_add(1);
  const std::lock_guard lock(mutex_);
  parcel.order = orders_++;
  if (parcel.device >= 0) {
    Sender& sender = senders_[static_cast<std::size_t>(parcel.device)];
    if (parcel.frame.what == Delivery<Frame>::What::disconnected) ++sender.unplugged;
    parcel.unplugged = sender.unplugged;
  }
  parcels_.push(parcel);
  posted_.notify_all();
}

void DeliveryQueue::deliver_until(HostStamp horizon) {
  for (;;) {
    if (stopping() || parcels_.empty() || parcels_.top().arrival >= horizon) return;
    const QueuedDelivery parcel = parcels_.top();
    parcels_.pop();
    deliver(parcel, parcel.arrival);
  }
}

void DeliveryQueue::hand_out_in_time() {
  (void)pthread_setname_np(pthread_self(), "vergence-mockio");
  std::unique_lock lock(mutex_);
  while (!stopping()) {
    if (parcels_.empty()) {
      if (finished_) return;
      posted_.wait(lock);
      continue;
    }
    const HostStamp now = monotonic_now();
    // Nothing is awaited after the last delivery.
    const bool end = parcels_.top().frame.what == Delivery<Frame>::What::end;
    if (parcels_.top().arrival > now && !end) {
      (void)posted_.wait_for(lock, std::chrono::nanoseconds((parcels_.top().arrival - now).ns()));
      continue;
    }
    const QueuedDelivery parcel = parcels_.top();
    parcels_.pop();
    lock.unlock();
    deliver(parcel, monotonic_now());
    lock.lock();
  }
}

template <class S, class D>
bool DeliveryQueue::push_or_wait(S* stream, const D& delivery) {
  for (;;) {
    const WakeEvent::Ticket seen = rig_.room.ticket();
    if (stopping() || !stream->streaming()) return false;
    if (stream->push(delivery)) return true;
    if (rig_.options.real_time) return false;
    rig_.room.wait(seen);
  }
}

void DeliveryQueue::deliver(const QueuedDelivery& parcel, HostStamp arrival) {
  if (parcel.device == kTriggerDevice) {
    Delivery<BoardReport> d = parcel.report;
    d.arrival = arrival;
    d.value.pulse.arrival = arrival;
    // Reports need no consumer; the latest that find no room are counted.
    if (trigger_->stream.streaming() && !trigger_->stream.push(d))
      trigger_->overruns.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  if (parcel.device == kInsDevice) {
    Delivery<InsReading> d = parcel.reading;
    d.arrival = arrival;
    if (rig_.options.real_time && ins_.stream.full())
      ins_.overruns.fetch_add(1, std::memory_order_relaxed);
    (void)push_or_wait(&ins_.stream, d);
    return;
  }
  deliver_frame(parcel, arrival);
}

void DeliveryQueue::deliver_frame(const QueuedDelivery& parcel, HostStamp arrival) {
  Delivery<Frame> d = parcel.frame;
  d.arrival = arrival;
  const auto k = static_cast<std::size_t>(parcel.device);
  if (d.what != Delivery<Frame>::What::item) {
    senders_[k].known_disconnected = parcel.unplugged;
    (void)push_or_wait(&cameras_[k]->stream, d);
    return;
  }
  senders_[k].on_the_way.fetch_sub(1);
  // Frames in transit when the camera was unplugged are lost: a stream has nothing but
  // `reconnected` behind a `disconnected`.
  if (parcel.unplugged != senders_[k].known_disconnected) {
    cameras_[k]->lost.fetch_add(1, std::memory_order_relaxed);
    keep_spare(parcel);
    return;
  }
  // The stream is deeper than the slots: frames always find room while they are consumed.
  if (k == 0) rig_.unseen.fetch_add(1);
  if (push_or_wait(&cameras_[k]->stream, d)) return;
  if (k == 0) rig_.unseen.fetch_sub(1);
  keep_spare(parcel);
}

void DeliveryQueue::keep_spare(const QueuedDelivery& parcel) {
  const std::lock_guard lock(mutex_);
  senders_[static_cast<std::size_t>(parcel.device)].spare.push_back(parcel.frame.value.slot);
}

}  // namespace vergence::mock
