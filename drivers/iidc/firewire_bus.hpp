#pragma once
#include <dc1394/dc1394.h>

#include <atomic>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "drivers/iidc/bus.hpp"
#include "drivers/iidc/firewire_nodes.hpp"
#include "drivers/iidc/firewire_ring.hpp"

namespace vergence::iidc {

/// IIDC camera on IEEE 1394, by libdc1394.
///
/// Slots are libdc1394's DMA ring (FirewireRing) and survive a disconnect while they are held.
/// Between start() and stop() a thread polls the capture with a limit, because libdc1394's own wait
/// has none.
class FirewireBus final : public CameraBus {
 public:
  /// `requested` as in names_camera(). Returns null on failure; *status and *error have the reason.
  [[nodiscard]] static std::unique_ptr<FirewireBus> open(std::string_view requested,
                                                         DeviceStatus* status, std::string* error);
  ~FirewireBus() override;
  FirewireBus(const FirewireBus&) = delete;
  FirewireBus& operator=(const FirewireBus&) = delete;

  [[nodiscard]] const ConfigRom& rom() const noexcept { return node_.rom; }
  /// Bus of the camera; all cameras of a bus share its clock.
  [[nodiscard]] const std::string& bus() const noexcept { return node_.bus; }
  [[nodiscard]] DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept override;
  [[nodiscard]] DeviceStatus write(std::uint64_t address, std::uint32_t value) noexcept override;
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] const BusTraits& traits() const noexcept override { return traits_; }
  [[nodiscard]] DeviceStatus allocate(const StreamShape& shape) noexcept override;
  [[nodiscard]] DeviceStatus start(StreamSink* sink) noexcept override;
  void stop() noexcept override;
  [[nodiscard]] DeviceStatus reopen() noexcept override;
  void give_back(FrameSlot slot) noexcept override;
  [[nodiscard]] const std::uint8_t* bytes(FrameSlot slot) const noexcept override {
    return ring_.bytes(slot);
  }
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  FirewireBus() = default;
  [[nodiscard]] DeviceStatus open_node(std::string_view requested);
  void close_node() noexcept;
  void end_ring() noexcept;
  void end_capture() noexcept;
  void stream() noexcept;
  [[nodiscard]] bool read_event() noexcept;
  [[nodiscard]] DeviceStatus failure(HostStamp begun) const noexcept;

  FirewireNode node_{};
  DeviceInfo info_{};
  BusTraits traits_{true, BusSpeed::s800, largest_packet(BusSpeed::s800), 0};
  std::string last_error_;
  dc1394_t* library_ = nullptr;
  dc1394camera_t* camera_ = nullptr;
  // Descriptor of the lock against other instances of this program.
  int lock_ = -1;

  FirewireRing ring_;
  StreamSink* sink_ = nullptr;
  std::thread thread_;
  // Descriptor of an eventfd.
  int wake_ = -1;
  std::atomic<bool> stopping_{false}, lost_{false};
};

}  // namespace vergence::iidc
