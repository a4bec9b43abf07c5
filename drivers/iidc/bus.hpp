#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/memory/frame_pool.hpp"
#include "drivers/device.hpp"
#include "drivers/options/iidc_options.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"

/// Connection to an IIDC camera, registers and stream, common to USB, IEEE 1394 and a fake in
/// tests.
namespace vergence::iidc {

/// Registers of one camera, by their 48-bit addresses.
///
/// Threads  One caller at a time.
/// Time     Every call ends at the latest after the transport's own timeout (one second on USB, the
///          split timeout on 1394).
/// Errors   → ok, unsupported (the camera refuses that address), timeout, disconnected, failed
class RegisterPort {
 public:
  virtual ~RegisterPort() = default;
  [[nodiscard]] virtual DeviceStatus read(std::uint64_t address, std::uint32_t* value) noexcept = 0;
  [[nodiscard]] virtual DeviceStatus write(std::uint64_t address, std::uint32_t value) noexcept = 0;
};

/// Layout of a frame in transit.
struct StreamShape {
  /// Bytes of the pixels of an image.
  std::size_t image_bytes = 0;
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
  /// False if the buffer is needed immediately and cannot be kept.
  bool spare = true;
  bool has_bus_stamp = false;
  /// Time of the first packet on the bus, by the host's clock.
  HostStamp bus_stamp{};
};

/// Receiver of the stream's frames. Called on the stream's thread.
class StreamSink {
 public:
  virtual ~StreamSink() = default;
  /// Returns true to keep the slot until give_back(); not permitted if `spare` is false.
  [[nodiscard]] virtual bool frame(const Arrival& arrival) noexcept = 0;
  /// Reports that the device is disconnected; no call follows.
  virtual void disconnected(HostStamp at) noexcept = 0;
};

/// Capabilities of a bus, for choosing a mode.
struct BusTraits {
  /// True if each cycle has one packet, in order, so that a lost packet shifts the rest of its
  /// frame.
  bool isochronous = false;
  /// Fastest speed on the path to the camera. For USB, S800 has the same packets.
  BusSpeed fastest = BusSpeed::s400;
  /// Maximum packet size, in bytes.
  std::size_t largest_packet = 0;
  /// Maximum data rate.
  double bytes_per_second = 0;
};

/// Share of a USB link's raw data rate that host controllers reach.
inline constexpr double kUsbPractical = 0.62;

/// Connection of one camera to a bus.
///
/// Ownership  A slot belongs to the bus until frame() keeps it, then to the sink until give_back().
///            bytes() stays valid that long, also across stop(), a disconnect and reopen().
/// Threads    The owner calls start, stop, reopen, allocate and the registers. give_back and bytes
///            are thread-safe.
/// Errors     No call throws.
class CameraBus : public RegisterPort {
 public:
  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  [[nodiscard]] virtual const BusTraits& traits() const noexcept = 0;
  /// Allocates memory for such frames. Precondition: stopped, no slot kept. → ok, failed
  [[nodiscard]] virtual DeviceStatus allocate(const StreamShape& shape) noexcept = 0;
  /// Starts the stream; buffers are ready when it returns. → ok, disconnected, no_permission,
  /// no_bandwidth, failed
  [[nodiscard]] virtual DeviceStatus start(StreamSink* sink) noexcept = 0;
  /// Stops the stream. The sink is not called after it returns. May be called twice.
  virtual void stop() noexcept = 0;
  /// Finds the camera again after disconnected() and opens it. Precondition: stopped. → ok,
  /// disconnected, no_permission, busy
  [[nodiscard]] virtual DeviceStatus reopen() noexcept = 0;

  virtual void give_back(FrameSlot slot) noexcept = 0;
  [[nodiscard]] virtual const std::uint8_t* bytes(FrameSlot slot) const noexcept = 0;

  /// Message about the last call that was not ok; empty if the status is sufficient.
  [[nodiscard]] virtual std::string last_error() const { return {}; }
};

}  // namespace vergence::iidc
