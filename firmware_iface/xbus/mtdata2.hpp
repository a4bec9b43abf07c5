#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware_iface/xbus/values.hpp"

/// MTData2 (message 36) of MTi-G-700/710 and related devices: packets of id (16 bits), size (8
/// bits) and data, big endian. All packets are optional and in any order, so stamps are valid only
/// after the whole message was parsed.
namespace vergence::xbus {

/// Ids of packets, without number format (+ 0 … 3) and frame (+ 0 ENU, + 4 NED, + 8 NWU).
enum class PacketId : std::uint16_t {
  temperature = 0x0810,
  utc = 0x1010,
  packet_counter = 0x1020,
  sample_time_fine = 0x1060,
  sample_time_coarse = 0x1070,
  quaternion = 0x2010,
  rotation_matrix = 0x2020,
  euler = 0x2030,
  pressure = 0x3010,
  delta_v = 0x4010,
  acceleration = 0x4020,
  free_acceleration = 0x4030,
  altitude_msl = 0x5010,
  altitude_ellipsoid = 0x5020,
  position_ecef = 0x5030,
  latitude_longitude = 0x5040,
  gnss_pvt = 0x7010,
  satellites = 0x7020,
  rate_of_turn = 0x8020,
  delta_q = 0x8030,
  magnetic_field = 0xC020,
  velocity = 0xD010,
  status_byte = 0xE010,
  status_word = 0xE020,
};

[[nodiscard]] constexpr PacketId packet_id(std::uint16_t id) noexcept {
  return static_cast<PacketId>(id & 0xFFF0U);
}
/// Id as transmitted.
[[nodiscard]] constexpr std::uint16_t wire_id(PacketId id,
                                              NumberFormat format = NumberFormat::float32,
                                              LocalFrame frame = LocalFrame::enu) noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(id) | static_cast<unsigned>(format) |
                                    (static_cast<unsigned>(frame) << 2U));
}
/// Size of a packet's data in bytes; empty if unknown or variable.
[[nodiscard]] std::optional<std::size_t> packet_size(std::uint16_t id) noexcept;

/// Bits of the status word (status_word); the status byte is its lowest eight.
inline constexpr std::uint32_t kStatusSelfTest = 1U << 0U;
inline constexpr std::uint32_t kStatusFilterValid = 1U << 1U;
inline constexpr std::uint32_t kStatusGnssFix = 1U << 2U;
inline constexpr std::uint32_t kStatusClockSynced = 1U << 6U;
inline constexpr std::uint32_t kStatusSyncOutMarker = 1U << 22U;
/// Filter mode of a status word: 0 without GNSS, 1 coasting (less than a minute without), 3 with
/// GNSS.
[[nodiscard]] constexpr unsigned filter_mode(std::uint32_t status_word) noexcept {
  return (status_word >> 23U) & 7U;
}

/// Packet in a payload.
struct Packet {
  std::uint16_t id = 0;
  std::span<const std::uint8_t> data{};
};

/// Iterates over a payload. Terminates, because each packet has at least three bytes.
class PacketReader {
 public:
  explicit PacketReader(std::span<const std::uint8_t> payload) noexcept : rest_(payload) {}
  /// Returns the next packet. If false, the payload is at its end or truncated(), and *packet
  /// unchanged.
  [[nodiscard]] bool next(Packet* packet) noexcept;
  /// True if the rest is no complete packet; the message is then invalid despite its checksum.
  [[nodiscard]] bool truncated() const noexcept { return !rest_.empty(); }

 private:
  std::span<const std::uint8_t> rest_;
};

/// Quality of the fix from GNSS position, velocity and time (7010).
struct GnssPvt {
  /// 0 none, 1 dead reckoning, 2 2D, 3 3D, 4 GNSS and dead reckoning, 5 time only.
  std::uint8_t fix = 0;
  /// Bits: 1 fix ok, 2 differential, 20h heading of vehicle valid.
  std::uint8_t flags = 0;
  std::uint8_t satellites = 0;
  /// FFFFFFFF without a fix.
  std::uint32_t horizontal_accuracy_mm = 0, vertical_accuracy_mm = 0;
  std::uint32_t speed_accuracy_mm_s = 0;
  /// 9999 without a fix.
  std::uint16_t position_dop_1e2 = 0;
};

/// Fields of a message that an INS sample uses; absent without the packet, or if its size or number
/// is invalid. Units as in the names.
struct Mtdata2 {
  /// Increases by one with every message, whatever its content.
  std::optional<std::uint16_t> packet_counter;
  /// In 0.1 ms; wraps at 864 000 000 (one day) or 2³², by generation.
  std::optional<std::uint32_t> sample_time_fine;
  std::optional<Utc> utc;
  std::optional<std::uint8_t> status_byte;
  std::optional<std::uint32_t> status_word;
  /// Quaternion w x y z, sensor → local frame.
  std::optional<std::array<double, 4>> quaternion;
  LocalFrame orientation_frame = LocalFrame::enu;
  std::optional<std::array<double, 2>> latitude_longitude_deg;
  std::optional<double> altitude_ellipsoid_m;
  /// In m/s, in velocity_frame.
  std::optional<Three> velocity;
  LocalFrame velocity_frame = LocalFrame::enu;
  std::optional<GnssPvt> gnss_pvt;
  /// True if there was a list of satellites (7020).
  bool satellites = false;
};

/// Appends packets to a payload in the caller's memory. A packet that does not fit is not written,
/// and full() is true from then on.
class PacketWriter {
 public:
  explicit PacketWriter(std::span<std::uint8_t> out) noexcept : out_(out) {}
  void put(std::uint16_t id, std::span<const std::uint8_t> data) noexcept;
  /// Writes at most nine numbers in the format of the id's lowest two bits.
  void put_numbers(std::uint16_t id, std::span<const double> values) noexcept;
  void put_u16(std::uint16_t id, std::uint16_t value) noexcept;
  void put_u32(std::uint16_t id, std::uint32_t value) noexcept;
  void put_utc(const Utc& utc) noexcept;
  void put_pvt(const GnssPvt& pvt) noexcept;
  [[nodiscard]] std::span<const std::uint8_t> payload() const noexcept { return out_.first(size_); }
  [[nodiscard]] bool full() const noexcept { return full_; }

 private:
  std::span<std::uint8_t> out_;
  std::size_t size_ = 0;
  bool full_ = false;
};

/// Decodes a message's payload. Returns false, with *out unchanged, if it is truncated. A packet's
/// length takes precedence over its id's format bits, because some firmware announces a double and
/// sends four bytes.
///
///     Message message;  // of a FrameStream
///     Mtdata2 data;
///     while (stream.next(&message))
///       if (message.is(MessageId::mtdata2) && decode_mtdata2(message.payload, &data) &&
///           data.quaternion)
///         use(*data.quaternion);
[[nodiscard]] bool decode_mtdata2(std::span<const std::uint8_t> payload, Mtdata2* out) noexcept;

}  // namespace vergence::xbus
