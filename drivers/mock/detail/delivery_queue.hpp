#pragma once
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <queue>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/mock/detail/devices.hpp"

namespace vergence::mock {

/// One delivery on its way; `device`: camera, kInsDevice or kTriggerDevice.
struct QueuedDelivery {
  HostStamp arrival{};
  std::uint64_t order = 0;  // of posting: breaks ties
  int device = 0;
  Delivery<Frame> frame{};
  Delivery<InsReading> reading{};
  Delivery<BoardReport> report{};
  std::uint32_t unplugged = 0;  // times the camera had been when this was posted
  [[nodiscard]] bool operator<(
      const QueuedDelivery& o) const noexcept {  // the queue's top is the earliest
    return std::pair(arrival, order) > std::pair(o.arrival, o.order);
  }
};
inline constexpr int kInsDevice = -1, kTriggerDevice = -2;

/// Deliveries of the simulated devices, handed to their streams in the order of arrival.
///
/// Threads  begin(), join(): the owner. post(), finish(), deliver_until(), pop_spare(),
///          on_the_way(): the producer. In real time a thread of its own hands out what is due.
/// Time     Virtual: deliver_until() waits for room in the streams. Real: what finds none is
///          dropped, and counted by its device.
/// Memory   Grows with what is under way.
class DeliveryQueue {
 public:
  /// All of it outlives the queue; `stop`: nothing is waited for any more.
  DeliveryQueue(RigContext& rig, std::vector<std::unique_ptr<MockCamera>>& cameras, MockIns& ins,
                const std::atomic<bool>& stop)
      : rig_(rig), cameras_(cameras), ins_(ins), stop_(stop) {}
  ~DeliveryQueue() { join(); }
  void attach(MockTrigger* trigger) noexcept { trigger_ = trigger; }

  /// Precondition: joined.
  void begin();
  /// Precondition: stopped, or finished.
  void join() noexcept;

  void post(QueuedDelivery parcel);
  /// The end of every device's deliveries; nothing more will be posted.
  void finish(HostStamp at);
  /// Virtual time: everything that arrives before that.
  void deliver_until(HostStamp horizon);

  /// Frames of camera k in the queue.
  [[nodiscard]] int on_the_way(int k) const noexcept {
    return senders_[static_cast<std::size_t>(k)].on_the_way.load();
  }
  /// A slot of camera k whose frame nobody was there for.
  [[nodiscard]] std::optional<FrameSlot> pop_spare(int k);

 private:
  struct Sender {
    std::atomic<int> on_the_way{0};
    std::uint32_t unplugged = 0;           // by what was posted; under mutex_
    std::uint32_t known_disconnected = 0;  // by what was delivered
    std::vector<FrameSlot> spare;          // of frames that nobody was there for; under mutex_
  };

  void hand_out_in_time();
  void deliver(const QueuedDelivery& parcel, HostStamp arrival);
  void deliver_frame(const QueuedDelivery& parcel, HostStamp arrival);
  void keep_spare(const QueuedDelivery& parcel);
  template <class S, class D>
  [[nodiscard]] bool push_or_wait(S* stream, const D& delivery);  // false: nobody takes it
  [[nodiscard]] bool stopping() const noexcept { return stop_.load(std::memory_order_acquire); }

  RigContext& rig_;
  std::vector<std::unique_ptr<MockCamera>>& cameras_;
  MockIns& ins_;
  MockTrigger* trigger_ = nullptr;
  const std::atomic<bool>& stop_;
  std::array<Sender, kMaxCameras> senders_{};
  std::uint64_t orders_ = 0;
  std::mutex mutex_;  // of parcels_, in real time
  std::condition_variable posted_;
  std::priority_queue<QueuedDelivery> parcels_;
  bool finished_ = false;  // under mutex_
  std::thread deliverer_;
};

}  // namespace vergence::mock
