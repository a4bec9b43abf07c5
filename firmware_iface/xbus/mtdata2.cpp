#include "firmware_iface/xbus/mtdata2.hpp"

#include <cmath>

#include "firmware_iface/xbus/bytes.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kPacketHeader = 3;  // id, id, size
constexpr std::size_t kUtcSize = 12;
constexpr std::size_t kPvtSize = 94;
constexpr std::size_t kSatelliteHeader = 8;

/// An id without its format and frame bits.
enum class Group : std::uint16_t {
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

Group group_of(std::uint16_t id) noexcept { return static_cast<Group>(id & 0xFFF0U); }

std::optional<LocalFrame> frame_of(std::uint16_t id) noexcept {
  const unsigned bits = (id >> 2U) & 3U;
  if (bits > static_cast<unsigned>(LocalFrame::nwu)) return std::nullopt;
  return static_cast<LocalFrame>(bits);
}

/// The format of numbers of `size` bytes each, by their length first and the id second; nothing: no format has this length.
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

double number(Bytes b, NumberFormat format) noexcept {
  switch (format) {
    case NumberFormat::float32:
      return read_float32(b);
    case NumberFormat::fp12_20:
      return read_fp12_20(b);
    case NumberFormat::fp16_32:
      return read_fp16_32(b);
    case NumberFormat::float64:
      return read_float64(b);
  }
  return 0;  // not reached: two bits have four values
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
    values[i] = number(packet.data.subspan(i * size, size), *format);
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
bool store_in_frame(const Packet& packet, const std::optional<T>& decoded, std::optional<T>* field, LocalFrame* frame) noexcept {
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
  *field = Utc{read_u32(b), read_u16(b.subspan(4)), b[6], b[7], b[8], b[9], b[10], b[11]};
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
  if (b.size() < kSatelliteHeader || b.size() != kSatelliteHeader + std::size_t{4} * b[4]) return false;
  *field = SatelliteInfo{read_u32(b), b[4], b.subspan(kSatelliteHeader)};
  return true;
}

enum class Taken : std::uint8_t { yes, refused, unknown };

Taken taken(bool stored) noexcept { return stored ? Taken::yes : Taken::refused; }

Taken take(const Packet& packet, Mtdata2* out) noexcept {
  switch (group_of(packet.id)) {
    case Group::temperature:
      return taken(store_scalar(packet, &out->temperature_c));
    case Group::utc:
      return taken(store_utc(packet.data, &out->utc));
    case Group::packet_counter:
      return taken(store_u16(packet.data, &out->packet_counter));
    case Group::sample_time_fine:
      return taken(store_u32(packet.data, &out->sample_time_fine));
    case Group::sample_time_coarse:
      return taken(store_u32(packet.data, &out->sample_time_coarse_s));
    case Group::quaternion:
      return taken(store_in_frame(packet, numbers<4>(packet), &out->quaternion, &out->orientation_frame));
    case Group::rotation_matrix:
      return taken(store_in_frame(packet, numbers<9>(packet), &out->rotation_matrix, &out->orientation_frame));
    case Group::euler:
      return taken(store_in_frame(packet, numbers<3>(packet), &out->euler_deg, &out->orientation_frame));
    case Group::pressure:
      return taken(store_u32(packet.data, &out->pressure_pa));
    case Group::delta_v:
      return taken(store(numbers<3>(packet), &out->delta_v));
    case Group::acceleration:
      return taken(store(numbers<3>(packet), &out->acceleration));
    case Group::free_acceleration:
      return taken(store(numbers<3>(packet), &out->free_acceleration));
    case Group::altitude_msl:
      return taken(store_scalar(packet, &out->altitude_msl_m));
    case Group::altitude_ellipsoid:
      return taken(store_scalar(packet, &out->altitude_ellipsoid_m));
    case Group::position_ecef:
      return taken(store(numbers<3>(packet), &out->position_ecef_m));
    case Group::latitude_longitude:
      if (!store(numbers<2>(packet), &out->latitude_longitude_deg)) return Taken::refused;
      out->position_format = *format_of(packet.id, packet.data.size() / 2);
      return Taken::yes;
    case Group::gnss_pvt:
      return taken(store_pvt(packet.data, &out->gnss_pvt));
    case Group::satellites:
      return taken(store_satellites(packet.data, &out->satellites));
    case Group::rate_of_turn:
      return taken(store(numbers<3>(packet), &out->rate_of_turn));
    case Group::delta_q:
      return taken(store(numbers<4>(packet), &out->delta_q));
    case Group::magnetic_field:
      return taken(store(numbers<3>(packet), &out->magnetic_field));
    case Group::velocity:
      return taken(store_in_frame(packet, numbers<3>(packet), &out->velocity, &out->velocity_frame));
    case Group::status_byte:
      if (packet.data.size() != 1) return Taken::refused;
      out->status_byte = packet.data[0];
      return Taken::yes;
    case Group::status_word:
      return taken(store_u32(packet.data, &out->status_word));
  }
  return Taken::unknown;
}

}  // namespace

PacketStatus PacketReader::next(Packet* packet) noexcept {
  if (rest_.empty()) return PacketStatus::end;
  if (rest_.size() < kPacketHeader || rest_.size() < kPacketHeader + rest_[2]) return PacketStatus::torn;
  *packet = {read_u16(rest_), rest_.subspan(kPacketHeader, rest_[2])};
  rest_ = rest_.subspan(kPacketHeader + rest_[2]);
  return PacketStatus::ok;
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
