#pragma once
#include <dc1394/dc1394.h>

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "drivers/iidc/bus.hpp"
#include "drivers/iidc/bus_ledger.hpp"
#include "drivers/iidc/firewire_nodes.hpp"
#include "drivers/iidc/slot_memory.hpp"

namespace vergence::iidc {

/// An IIDC camera on IEEE 1394, by libdc1394.
///
/// Stream     Slots are libdc1394's DMA ring. The library hands its buffers out by counting,
///            whatever was filled; which one was filled is told by the order in which they were
///            queued, kept here. So buffers can come back in any order, and one that finds no taker
///            goes back at once; kReserve stay with the kernel, that it never runs dry.
/// Threads    A thread polls the capture between start() and stop(), never without a limit:
///            libdc1394's own wait has none.
/// Slots      Two ranges of kMaxBuffers: after an unplug images that are still held stay mapped in
///            one, the new ring takes the other.
/// Unplug     libdc1394's capture_stop fails on a node that is gone, and leaves mapping and
///            descriptor: they are undone here. (Some kilobytes of its heap stay.)
/// Budget     Known before the start from what all cameras of the ledger need on this bus.
class FirewireBus final : public CameraBus {
 public:
  static constexpr std::size_t kReserve = 3;

  /// `requested` as names_camera(). Null: *status and *error say why.
  [[nodiscard]] static std::unique_ptr<FirewireBus> open(std::string_view requested,
                                                         std::shared_ptr<BusLedger> ledger,
                                                         DeviceStatus* status, std::string* error);
  ~FirewireBus() override;
  FirewireBus(const FirewireBus&) = delete;
  FirewireBus& operator=(const FirewireBus&) = delete;

  [[nodiscard]] const ConfigRom& rom() const noexcept { return node_.rom; }
  [[nodiscard]] std::shared_ptr<SharedClock> clock() const { return ledger_->clock(node_.bus); }
  [[nodiscard]] DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept override;
  [[nodiscard]] DeviceStatus write(std::uint64_t address, std::uint32_t value) noexcept override;
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] const BusTraits& traits() const noexcept override { return traits_; }
  [[nodiscard]] DeviceStatus allocate(const StreamShape& shape) noexcept override;
  [[nodiscard]] DeviceStatus start(StreamSink* sink) noexcept override;
  void stop() noexcept override;
  [[nodiscard]] DeviceStatus reopen() noexcept override;
  void give_back(FrameSlot slot) noexcept override;
  [[nodiscard]] const std::uint8_t* bytes(FrameSlot slot) const noexcept override;
  [[nodiscard]] std::string last_error() const override { return last_error_; }
  [[nodiscard]] std::string remark(const StreamShape& shape, double rate_hz,
                                   int sharing) const override;

 private:
  /// One range of slots and what is mapped for it.
  struct Map {
    std::uint8_t* base = nullptr;
    std::size_t length = 0;
    std::size_t stride = 0;
  };
  FirewireBus() = default;
  [[nodiscard]] DeviceStatus open_node(std::string_view requested);
  void close_node() noexcept;
  [[nodiscard]] DeviceStatus set_up();
  [[nodiscard]] bool find_map();
  void tear_down() noexcept;
  void abandon() noexcept;
  void drop_orphan() noexcept;
  void resume() noexcept;
  void stream() noexcept;
  [[nodiscard]] bool take_one() noexcept;
  void enqueue(std::size_t buffer) noexcept;
  void enqueue_returned() noexcept;
  [[nodiscard]] DeviceStatus failure(HostStamp begun) const noexcept;
  [[nodiscard]] Map& map() noexcept { return maps_[generation_.load(std::memory_order_relaxed)]; }
  [[nodiscard]] FrameSlot slot_of(std::size_t buffer) const noexcept {
    return static_cast<FrameSlot>(generation_.load(std::memory_order_relaxed) * kMaxBuffers +
                                  buffer);
  }
  [[nodiscard]] std::uint64_t kept_in(std::size_t generation) const noexcept {
    return kept_.bits() >> generation * kMaxBuffers & 0xFFFF'FFFFU;
  }

  std::shared_ptr<BusLedger> ledger_;
  FirewireNode node_{};
  DeviceInfo info_{};
  BusTraits traits_{true, BusSpeed::s800, largest_packet(BusSpeed::s800), 0};
  std::string last_error_;
  dc1394_t* library_ = nullptr;
  dc1394camera_t* camera_ = nullptr;
  int lock_ = -1;  // descriptor that keeps other programs of ours away

  StreamShape shape_{};
  bool captured_ = false;
  std::array<Map, 2> maps_{};
  std::atomic<std::size_t> generation_{0};         // of maps_, in use
  std::array<std::uint8_t, kMaxBuffers> queue_{};  // buffers with the kernel, in order
  std::size_t queue_first_ = 0, queued_ = 0;
  SlotSet kept_;      // slots that the sink has
  SlotSet returned_;  // slots of this generation on their way back to the kernel

  StreamSink* sink_ = nullptr;
  std::thread thread_;
  int wake_ = -1;  // eventfd
  std::atomic<bool> stopping_{false}, lost_{false};
};

}  // namespace vergence::iidc
