#pragma once
#include <libusb-1.0/libusb.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/iidc/bus.hpp"
#include "drivers/iidc/slot_memory.hpp"
#include "firmware_iface/iidc/config_rom.hpp"

namespace vergence::iidc {

inline constexpr Duration kUsbRegisterLimit = Duration::seconds(1);

/// IIDC camera on USB.
///
/// Registers  Control requests, each at most kUsbRegisterLimit.
/// Stream     kTransfers bulk transfers of a whole frame each, directly into the slots. A full slot
///            is replaced in the same callback, so the camera never waits. A short or empty packet
///            ends a frame.
/// Threads    A thread handles libusb's events between start() and stop() and stamps arrivals in
///            its callbacks. During a register access the owner's thread may run a callback
///            instead, never simultaneously.
/// Stop       Transfers are cancelled and awaited for at most kCancelLimit. The others are
///            abandoned with their memory, which the kernel may still write; then only reopen()
///            recovers.
/// Unplug     Detected by failed transfers. reopen() searches with its own context each time, so it
///            needs no hot-plug events, which containers and small systems lack.
class UsbBus final : public CameraBus {
 public:
  /// Enough for 130 ms at 30 Hz, longer than any observed scheduling delay.
  static constexpr std::size_t kTransfers = 4;
  static constexpr Duration kCancelLimit = Duration::seconds(2);

  /// `requested` as in names_camera(). Returns null on failure; *status and *error have the reason.
  [[nodiscard]] static std::unique_ptr<UsbBus> open(std::string_view requested,
                                                    DeviceStatus* status, std::string* error);
  ~UsbBus() override;
  UsbBus(const UsbBus&) = delete;
  UsbBus& operator=(const UsbBus&) = delete;

  [[nodiscard]] const ConfigRom& rom() const noexcept { return rom_; }
  [[nodiscard]] DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept override;
  [[nodiscard]] DeviceStatus write(std::uint64_t address, std::uint32_t value) noexcept override;
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] const BusTraits& traits() const noexcept override { return traits_; }
  [[nodiscard]] DeviceStatus allocate(const StreamShape& shape) noexcept override;
  [[nodiscard]] DeviceStatus start(StreamSink* sink) noexcept override;
  void stop() noexcept override;
  [[nodiscard]] DeviceStatus reopen() noexcept override;
  void give_back(FrameSlot slot) noexcept override { memory_->release(slot); }
  [[nodiscard]] const std::uint8_t* bytes(FrameSlot slot) const noexcept override {
    return memory_->bytes(slot);
  }
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  struct Flight {
    UsbBus* bus = nullptr;
    libusb_transfer* transfer = nullptr;
    FrameSlot slot = 0;
    bool flying = false;
  };
  UsbBus() = default;
  [[nodiscard]] DeviceStatus open_device(std::string_view requested);
  [[nodiscard]] DeviceStatus claim(libusb_device_handle* handle);
  void close_device() noexcept;
  void drop_memory() noexcept;
  [[nodiscard]] int submit(Flight* flight) noexcept;
  void completed(Flight* flight) noexcept;
  void filled(Flight* flight) noexcept;
  void land(Flight* flight) noexcept;
  [[nodiscard]] bool abandoned() const noexcept;
  void let_go() noexcept;
  void lose() noexcept;
  void handle_events() noexcept;
  static void on_transfer(libusb_transfer* transfer);

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  int interface_ = -1;
  unsigned char endpoint_ = 0;
  DeviceInfo info_{};
  BusTraits traits_{};
  ConfigRom rom_{};
  std::string last_error_;

  StreamShape shape_{};
  std::size_t transfer_bytes_ = 0;
  std::unique_ptr<SlotMemory> memory_;
  // True if transfers were abandoned; memory_ is then never freed.
  bool given_up_ = false;
  std::vector<Flight> flights_;
  StreamSink* sink_ = nullptr;
  std::thread thread_;
  std::atomic<int> flying_{0};
  std::atomic<bool> stopping_{false}, lost_{false};
  // Number of consecutive failed transfers.
  int errors_ = 0;
};

}  // namespace vergence::iidc
