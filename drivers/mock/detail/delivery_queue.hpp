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

/// Scheduled delivery; `device` is a camera index, kInsDevice or kTriggerDevice.
struct QueuedDelivery {
  HostStamp arrival{};
  /// Order of posting, which breaks ties.
  std::uint64_t order = 0;
  int device = 0;
  Delivery<Frame> frame{};
  Delivery<InsReading> reading{};
  Delivery<BoardReport> report{};
  /// Number of the camera's disconnects when this was posted.
  std::uint32_t unplugged = 0;
  /// The top of the priority queue is the earliest.
  [[nodiscard]] bool operator<(const QueuedDelivery& o) const noexcept {
    return std::pair(arrival, order) > std::pair(o.arrival, o.order);
  }
};
inline constexpr int kInsDevice = -1, kTriggerDevice = -2;

/// Delivers the simulated devices' data to their streams in order of arrival.
///
/// Threads  The owner calls begin() and join(), the producer the other functions. In real time an
///          own thread delivers what is due.
/// Time     Virtual: deliver_until() waits for room in the streams. Real: data without room are
///          dropped and counted by their device.
/// Memory   Grows with the queued deliveries.
class DeliveryQueue {
 public:
  /// All arguments must outlive the queue. `stop` ends all waiting.
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
  /// Posts the end of every device's deliveries; must be the last post.
  void finish(HostStamp at);
  /// Virtual time: delivers everything that arrives before `horizon`.
  void deliver_until(HostStamp horizon);

  /// Number of frames of camera k in the queue.
  [[nodiscard]] int on_the_way(int k) const noexcept {
    return senders_[static_cast<std::size_t>(k)].on_the_way.load();
  }
  /// Slot of a frame of camera k that had no consumer.
  [[nodiscard]] std::optional<FrameSlot> pop_spare(int k);

 private:
  struct Sender {
    std::atomic<int> on_the_way{0};
    // Count of posted disconnects; guarded by mutex_.
    std::uint32_t unplugged = 0;
    // Count of delivered disconnects.
    std::uint32_t known_disconnected = 0;
    // Slots of frames without a consumer; guarded by mutex_.
    std::vector<FrameSlot> spare;
  };

  void hand_out_in_time();
  void deliver(const QueuedDelivery& parcel, HostStamp arrival);
  void deliver_frame(const QueuedDelivery& parcel, HostStamp arrival);
  void keep_spare(const QueuedDelivery& parcel);
  // Returns false if there is no consumer.
  template <class S, class D>
  [[nodiscard]] bool push_or_wait(S* stream, const D& delivery);
  [[nodiscard]] bool stopping() const noexcept { return stop_.load(std::memory_order_acquire); }

  RigContext& rig_;
  std::vector<std::unique_ptr<MockCamera>>& cameras_;
  MockIns& ins_;
  MockTrigger* trigger_ = nullptr;
  const std::atomic<bool>& stop_;
  std::array<Sender, kMaxCameras> senders_{};
  std::uint64_t orders_ = 0;
  // Guards parcels_ in real time.
  std::mutex mutex_;
  std::condition_variable posted_;
  std::priority_queue<QueuedDelivery> parcels_;
  // Guarded by mutex_.
  bool finished_ = false;
  std::thread deliverer_;
};

}  // namespace vergence::mock
