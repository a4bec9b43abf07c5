#include "firmware_iface/xbus/mtdata2.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_iface/xbus/bytes.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kPacketHeader = 3;  // id, id, size
constexpr std::size_t kPvtSize = 94;
constexpr std::size_t kSatelliteHeader = 8;

std::optional<LocalFrame> frame_of(std::uint16_t id) noexcept {
  const unsigned bits = (id >> 2U) & 3U;
  if (bits > static_cast<unsigned>(LocalFrame::nwu)) return std::nullopt;
  return static_cast<LocalFrame>(bits);
}

/// The format of numbers of `size` bytes each, by their length first and the id second; nothing: no
/// format has this length.
std::optional<NumberFormat> format_of(std::uint16_t id, std::size_t size) noexcept {
  const auto announced = static_cast<NumberFormat>(id & 3U);
  switch (size) {
    case 4:
      return announced == NumberFormat::fp12_20 ? NumberFormat::fp12_20 : NumberFormat::float32;
    case 6:
      return NumberFormat::fp16_32;
    case 8:
      return NumberFormat::float64;
    default:
      return std::nullopt;
  }
}

/// N numbers, or nothing when the packet cannot hold N or one is not finite.
template <std::size_t N>
std::optional<std::array<double, N>> numbers(const Packet& packet) noexcept {
  if (packet.data.size() % N != 0) return std::nullopt;
  const std::size_t size = packet.data.size() / N;
  const std::optional<NumberFormat> format = format_of(packet.id, size);
  if (!format) return std::nullopt;
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    values[i] = read_number(packet.data.subspan(i * size, size), *format);
    if (!std::isfinite(values[i])) return std::nullopt;
  }
  return values;
}

/// Stores what was decoded; false: nothing was.
template <class T>
bool store(const std::optional<T>& decoded, std::optional<T>* field) noexcept {
  if (decoded) *field = decoded;
  return decoded.has_value();
}

/// The same with the frame that the numbers refer to.
template <class T>
bool store_in_frame(const Packet& packet, const std::optional<T>& decoded, std::optional<T>* field,
                    LocalFrame* frame) noexcept {
  const std::optional<LocalFrame> named = frame_of(packet.id);
  if (!decoded || !named) return false;
  *field = decoded;
  *frame = *named;
  return true;
}

bool store_scalar(const Packet& packet, std::optional<double>* field) noexcept {
  const auto decoded = numbers<1>(packet);
  if (decoded) *field = (*decoded)[0];
  return decoded.has_value();
}

bool store_u16(Bytes b, std::optional<std::uint16_t>* field) noexcept {
  if (b.size() != 2) return false;
  *field = read_u16(b);
  return true;
}

bool store_u32(Bytes b, std::optional<std::uint32_t>* field) noexcept {
  if (b.size() != 4) return false;
  *field = read_u32(b);
  return true;
}

bool store_utc(Bytes b, std::optional<Utc>* field) noexcept {
  if (b.size() != kUtcSize) return false;
  *field = read_utc(b);
  return true;
}

bool store_pvt(Bytes b, std::optional<GnssPvt>* field) noexcept {
  if (b.size() != kPvtSize) return false;
  const auto u32 = [b](std::size_t at) { return read_u32(b.subspan(at)); };
  const auto i32 = [b](std::size_t at) { return read_i32(b.subspan(at)); };
  GnssPvt p;
  p.itow_ms = u32(0);
  p.year = read_u16(b.subspan(4));
  p.month = b[6];
  p.day = b[7];
  p.hour = b[8];
  p.minute = b[9];
  p.second = b[10];
  p.valid = b[11];
  p.time_accuracy_ns = u32(12);
  p.nanosecond = i32(16);
  p.fix = b[20];
  p.flags = b[21];
  p.satellites = b[22];  // 23 is reserved
  p.longitude_1e7_deg = i32(24);
  p.latitude_1e7_deg = i32(28);
  p.height_ellipsoid_mm = i32(32);
  p.height_msl_mm = i32(36);
  p.horizontal_accuracy_mm = u32(40);
  p.vertical_accuracy_mm = u32(44);
  p.velocity_north_mm_s = i32(48);
  p.velocity_east_mm_s = i32(52);
  p.velocity_down_mm_s = i32(56);
  p.ground_speed_mm_s = i32(60);
  p.heading_of_motion_1e5_deg = i32(64);
  p.speed_accuracy_mm_s = u32(68);
  p.heading_accuracy_1e5_deg = u32(72);
  p.heading_of_vehicle_1e5_deg = i32(76);
  for (std::size_t i = 0; i < p.dop_1e2.size(); ++i) p.dop_1e2[i] = read_u16(b.subspan(80 + 2 * i));
  *field = p;
  return true;
}

bool store_satellites(Bytes b, std::optional<SatelliteInfo>* field) noexcept {
  if (b.size() < kSatelliteHeader || b.size() != kSatelliteHeader + std::size_t{4} * b[4])
    return false;
  *field = SatelliteInfo{read_u32(b), b[4], b.subspan(kSatelliteHeader)};
  return true;
}

enum class Taken : std::uint8_t { yes, refused, unknown };

Taken taken(bool stored) noexcept { return stored ? Taken::yes : Taken::refused; }

Taken take(const Packet& packet, Mtdata2* out) noexcept {
  switch (packet_id(packet.id)) {
    case PacketId::temperature:
      return taken(store_scalar(packet, &out->temperature_c));
    case PacketId::utc:
      return taken(store_utc(packet.data, &out->utc));
    case PacketId::packet_counter:
      return taken(store_u16(packet.data, &out->packet_counter));
    case PacketId::sample_time_fine:
      return taken(store_u32(packet.data, &out->sample_time_fine));
    case PacketId::sample_time_coarse:
      return taken(store_u32(packet.data, &out->sample_time_coarse_s));
    case PacketId::quaternion:
      return taken(
          store_in_frame(packet, numbers<4>(packet), &out->quaternion, &out->orientation_frame));
    case PacketId::rotation_matrix:
      return taken(store_in_frame(packet, numbers<9>(packet), &out->rotation_matrix,
                                  &out->orientation_frame));
    case PacketId::euler:
      return taken(
          store_in_frame(packet, numbers<3>(packet), &out->euler_deg, &out->orientation_frame));
    case PacketId::pressure:
      return taken(store_u32(packet.data, &out->pressure_pa));
    case PacketId::delta_v:
      return taken(store(numbers<3>(packet), &out->delta_v));
    case PacketId::acceleration:
      return taken(store(numbers<3>(packet), &out->acceleration));
    case PacketId::free_acceleration:
      return taken(store(numbers<3>(packet), &out->free_acceleration));
    case PacketId::altitude_msl:
      return taken(store_scalar(packet, &out->altitude_msl_m));
    case PacketId::altitude_ellipsoid:
      return taken(store_scalar(packet, &out->altitude_ellipsoid_m));
    case PacketId::position_ecef:
      return taken(store(numbers<3>(packet), &out->position_ecef_m));
    case PacketId::latitude_longitude:
      if (!store(numbers<2>(packet), &out->latitude_longitude_deg)) return Taken::refused;
      out->position_format = *format_of(packet.id, packet.data.size() / 2);
      return Taken::yes;
    case PacketId::gnss_pvt:
      return taken(store_pvt(packet.data, &out->gnss_pvt));
    case PacketId::satellites:
      return taken(store_satellites(packet.data, &out->satellites));
    case PacketId::rate_of_turn:
      return taken(store(numbers<3>(packet), &out->rate_of_turn));
    case PacketId::delta_q:
      return taken(store(numbers<4>(packet), &out->delta_q));
    case PacketId::magnetic_field:
      return taken(store(numbers<3>(packet), &out->magnetic_field));
    case PacketId::velocity:
      return taken(
          store_in_frame(packet, numbers<3>(packet), &out->velocity, &out->velocity_frame));
    case PacketId::status_byte:
      if (packet.data.size() != 1) return Taken::refused;
      out->status_byte = packet.data[0];
      return Taken::yes;
    case PacketId::status_word:
      return taken(store_u32(packet.data, &out->status_word));
  }
  return Taken::unknown;
}

}  // namespace

PacketStatus PacketReader::next(Packet* packet) noexcept {
  if (rest_.empty()) return PacketStatus::end;
  if (rest_.size() < kPacketHeader || rest_.size() < kPacketHeader + rest_[2])
    return PacketStatus::torn;
  *packet = {read_u16(rest_), rest_.subspan(kPacketHeader, rest_[2])};
  rest_ = rest_.subspan(kPacketHeader + rest_[2]);
  return PacketStatus::ok;
}

std::optional<std::size_t> packet_size(std::uint16_t id) noexcept {
  const std::size_t number = size_of(static_cast<NumberFormat>(id & 3U));
  switch (packet_id(id)) {
    case PacketId::temperature:
    case PacketId::altitude_msl:
    case PacketId::altitude_ellipsoid:
      return number;
    case PacketId::latitude_longitude:
      return 2 * number;
    case PacketId::euler:
    case PacketId::delta_v:
    case PacketId::acceleration:
    case PacketId::free_acceleration:
    case PacketId::position_ecef:
    case PacketId::rate_of_turn:
    case PacketId::magnetic_field:
    case PacketId::velocity:
      return 3 * number;
    case PacketId::quaternion:
    case PacketId::delta_q:
      return 4 * number;
    case PacketId::rotation_matrix:
      return 9 * number;
    case PacketId::utc:
      return kUtcSize;
    case PacketId::packet_counter:
      return 2;
    case PacketId::sample_time_fine:
    case PacketId::sample_time_coarse:
    case PacketId::pressure:
    case PacketId::status_word:
      return 4;
    case PacketId::status_byte:
      return 1;
    case PacketId::gnss_pvt:
      return kPvtSize;
    case PacketId::satellites:
      break;
  }
  return std::nullopt;
}

void PacketWriter::put(std::uint16_t id, Bytes data) noexcept {
  constexpr std::size_t kLongest = 255;
  if (full_ || data.size() > kLongest || out_.size() - size_ < kPacketHeader + data.size()) {
    full_ = true;
    return;
  }
  const auto to = out_.subspan(size_);
  write_u16(to, id);
  to[2] = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), to.begin() + kPacketHeader);
  size_ += kPacketHeader + data.size();
}

void PacketWriter::put_numbers(std::uint16_t id, std::span<const double> values) noexcept {
  constexpr std::size_t kMost = 9;
  std::array<std::uint8_t, kMost * sizeof(double)> bytes{};
  const auto format = static_cast<NumberFormat>(id & 3U);
  const std::size_t size = size_of(format);
  if (values.size() > kMost) {
    full_ = true;
    return;
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    write_number(std::span(bytes).subspan(i * size), format, values[i]);
  put(id, std::span(bytes).first(values.size() * size));
}

void PacketWriter::put_u16(std::uint16_t id, std::uint16_t value) noexcept {
  std::array<std::uint8_t, 2> bytes{};
  write_u16(bytes, value);
  put(id, bytes);
}

void PacketWriter::put_u32(std::uint16_t id, std::uint32_t value) noexcept {
  std::array<std::uint8_t, 4> bytes{};
  write_u32(bytes, value);
  put(id, bytes);
}

void PacketWriter::put_utc(const Utc& utc) noexcept {
  std::array<std::uint8_t, kUtcSize> bytes{};
  write_utc(bytes, utc);
  put(wire_id(PacketId::utc), bytes);
}

void PacketWriter::put_pvt(const GnssPvt& p) noexcept {
  std::array<std::uint8_t, kPvtSize> b{};
  const auto u32 = [&b](std::size_t at, std::uint32_t v) {
    write_u32(std::span(b).subspan(at), v);
  };
  const auto i32 = [&u32](std::size_t at, std::int32_t v) {
    u32(at, static_cast<std::uint32_t>(v));
  };
  u32(0, p.itow_ms);
  write_u16(std::span(b).subspan(4), p.year);
  b[6] = p.month;
  b[7] = p.day;
  b[8] = p.hour;
  b[9] = p.minute;
  b[10] = p.second;
  b[11] = p.valid;
  u32(12, p.time_accuracy_ns);
  i32(16, p.nanosecond);
  b[20] = p.fix;
  b[21] = p.flags;
  b[22] = p.satellites;
  i32(24, p.longitude_1e7_deg);
  i32(28, p.latitude_1e7_deg);
  i32(32, p.height_ellipsoid_mm);
  i32(36, p.height_msl_mm);
  u32(40, p.horizontal_accuracy_mm);
  u32(44, p.vertical_accuracy_mm);
  i32(48, p.velocity_north_mm_s);
  i32(52, p.velocity_east_mm_s);
  i32(56, p.velocity_down_mm_s);
  i32(60, p.ground_speed_mm_s);
  i32(64, p.heading_of_motion_1e5_deg);
  u32(68, p.speed_accuracy_mm_s);
  u32(72, p.heading_accuracy_1e5_deg);
  i32(76, p.heading_of_vehicle_1e5_deg);
  for (std::size_t i = 0; i < p.dop_1e2.size(); ++i)
    write_u16(std::span(b).subspan(80 + 2 * i), p.dop_1e2[i]);
  put(wire_id(PacketId::gnss_pvt), b);
}

PacketStatus decode_mtdata2(Bytes payload, Mtdata2* out) noexcept {
  Mtdata2 decoded;
  PacketReader reader(payload);
  Packet packet;
  for (;;) {  // ends: every packet takes at least three bytes of the payload
    const PacketStatus status = reader.next(&packet);
    if (status == PacketStatus::torn) return PacketStatus::torn;
    if (status == PacketStatus::end) break;
    ++decoded.packets;
    switch (take(packet, &decoded)) {
      case Taken::yes:
        break;
      case Taken::refused:
        ++decoded.refused_packets;
        break;
      case Taken::unknown:
        ++decoded.unknown_packets;
        break;
    }
  }
  *out = decoded;
  return PacketStatus::ok;
}

}  // namespace vergence::xbus
