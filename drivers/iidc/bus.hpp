#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/memory/frame_pool.hpp"
#include "drivers/device.hpp"
#include "drivers/options/iidc_options.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"

/// Connection of an IIDC camera: registers and a stream, the same for USB, IEEE 1394 and a test's
/// fake.
namespace vergence::iidc {

/// The registers of one camera, by their 48-bit addresses.
///
/// Threads  One caller at a time.
/// Time     Every call ends, at the latest after the transport's own time-out (a second on USB, the
///          split time-out on 1394).
/// Errors   → ok, unsupported (the camera refuses that address), timeout, disconnected, failed
class RegisterPort {
 public:
  virtual ~RegisterPort() = default;
  [[nodiscard]] virtual DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept = 0;
  [[nodiscard]] virtual DeviceStatus write(std::uint64_t address, std::uint32_t value) noexcept = 0;
};

/// A frame in transit.
struct StreamShape {
  std::size_t image_bytes = 0;  // pixels
  /// Bytes of a frame, with the padding of the last packet.
  std::size_t frame_bytes = 0;
  /// Bytes of one bus cycle.
  std::size_t packet_bytes = 0;
  BusSpeed speed = BusSpeed::s400;
  /// Number of slots, 4 to kMaxBuffers.
  std::size_t buffers = 0;
  [[nodiscard]] bool operator==(const StreamShape&) const noexcept = default;
};

/// One filled buffer.
struct Arrival {
  FrameSlot slot = 0;
  const std::uint8_t* data = nullptr;
  std::size_t bytes = 0;
  /// Time when the last byte arrived.
  HostStamp at{};
  /// The transport reports an error of the frame.
  bool broken = false;
  /// False: the buffer is needed immediately and cannot be kept.
  bool spare = true;
  bool has_bus_stamp = false;
  /// Time of the first packet on the bus, by the host's clock.
  HostStamp bus_stamp{};
};

/// Receiver of the stream's frames. Called on the stream's thread.
class StreamSink {
 public:
  virtual ~StreamSink() = default;
  /// True: the slot is kept, until give_back(). Not possible when `spare` is false.
  [[nodiscard]] virtual bool frame(const Arrival& arrival) noexcept = 0;
  /// The device is gone; nothing follows.
  virtual void gone(HostStamp at) noexcept = 0;
};

/// Capabilities of a bus, for choosing a mode.
struct BusTraits {
  bool isochronous =
      false;  // one packet a cycle, in order; a lost one shifts the rest of its frame
  BusSpeed fastest =
      BusSpeed::s400;  // of the path to the camera; USB: its packets are as those of S800
  std::size_t largest_packet = 0;  // bytes
  double bytes_per_second = 0;     // at best
};

inline constexpr double kUsbPractical =
    0.62;  // of a USB wire's bytes a second: what host controllers reach

/// One camera's place on a bus.
///
/// Ownership  Slots are the bus's until frame() keeps them, then the sink's until give_back().
///            bytes() stays valid that long, also over stop(), an unplug and a reopen().
/// Threads    start, stop, reopen, allocate, registers: the owner's thread. give_back, bytes: any.
/// Errors     Nothing throws.
class CameraBus : public RegisterPort {
 public:
  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  [[nodiscard]] virtual const BusTraits& traits() const noexcept = 0;
  /// Memory for such frames. Precondition: stopped, no slot kept. → ok, failed
  [[nodiscard]] virtual DeviceStatus allocate(const StreamShape& shape) noexcept = 0;
  /// Buffers are ready for the camera when this returns. → ok, disconnected, no_permission,
  /// no_bandwidth, failed
  [[nodiscard]] virtual DeviceStatus start(StreamSink* sink) noexcept = 0;
  /// The camera has been told to be quiet, or is gone. No call of the sink after it returns. Twice
  /// is harmless.
  virtual void stop() noexcept = 0;
  /// After gone: finds the camera again and opens it. Precondition: stopped. → ok, disconnected,
  /// no_permission, busy
  [[nodiscard]] virtual DeviceStatus reopen() noexcept = 0;

  virtual void give_back(FrameSlot slot) noexcept = 0;
  [[nodiscard]] virtual const std::uint8_t* bytes(FrameSlot slot) const noexcept = 0;

  /// One message about the last call that was not ok; empty: the status says it all.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence::iidc
