#include "firmware_iface/xbus/mtdata2.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_iface/xbus/bytes.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::span<const std::uint8_t>;

// Two bytes of id and one of size.
constexpr std::size_t kPacketHeader = 3;
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

/// Stores what was decoded, with the frame that the numbers refer to.
template <class T>
void store_in_frame(const Packet& packet, const std::optional<T>& decoded, std::optional<T>* field,
                    LocalFrame* frame) noexcept {
  const std::optional<LocalFrame> named = frame_of(packet.id);
  if (!decoded || !named) return;
  *field = decoded;
  *frame = *named;
}

void store_u32(Bytes b, std::optional<std::uint32_t>* field) noexcept {
  if (b.size() == 4) *field = read_u32(b);
}

GnssPvt pvt_of(Bytes b) noexcept {
  GnssPvt p;
  p.fix = b[20];
  p.flags = b[21];
  p.satellites = b[22];
  p.horizontal_accuracy_mm = read_u32(b.subspan(40));
  p.vertical_accuracy_mm = read_u32(b.subspan(44));
  p.speed_accuracy_mm_s = read_u32(b.subspan(68));
  p.position_dop_1e2 = read_u16(b.subspan(82));
  return p;
}

void decode(const Packet& packet, Mtdata2* out) noexcept {
  const Bytes data = packet.data;
  switch (packet_id(packet.id)) {
    case PacketId::utc:
      if (data.size() == kUtcSize) out->utc = read_utc(data);
      return;
    case PacketId::packet_counter:
      if (data.size() == 2) out->packet_counter = read_u16(data);
      return;
    case PacketId::sample_time_fine:
      return store_u32(data, &out->sample_time_fine);
    case PacketId::quaternion:
      return store_in_frame(packet, numbers<4>(packet), &out->quaternion, &out->orientation_frame);
    case PacketId::altitude_ellipsoid:
      if (const auto metres = numbers<1>(packet)) out->altitude_ellipsoid_m = (*metres)[0];
      return;
    case PacketId::latitude_longitude:
      if (const auto place = numbers<2>(packet)) out->latitude_longitude_deg = place;
      return;
    case PacketId::gnss_pvt:
      if (data.size() == kPvtSize) out->gnss_pvt = pvt_of(data);
      return;
    case PacketId::satellites:
      out->satellites = data.size() >= kSatelliteHeader &&
                        data.size() == kSatelliteHeader + std::size_t{4} * data[4];
      return;
    case PacketId::velocity:
      return store_in_frame(packet, numbers<3>(packet), &out->velocity, &out->velocity_frame);
    case PacketId::status_byte:
      if (data.size() == 1) out->status_byte = data[0];
      return;
    case PacketId::status_word:
      return store_u32(data, &out->status_word);
    default:  // nothing that an INS sample is made of
      return;
  }
}

}  // namespace

bool PacketReader::next(Packet* packet) noexcept {
  if (rest_.size() < kPacketHeader || rest_.size() < kPacketHeader + rest_[2]) return false;
  *packet = {read_u16(rest_), rest_.subspan(kPacketHeader, rest_[2])};
  rest_ = rest_.subspan(kPacketHeader + rest_[2]);
  return true;
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
  constexpr std::size_t kMax = 9;
  std::array<std::uint8_t, kMax * sizeof(double)> bytes{};
  const auto format = static_cast<NumberFormat>(id & 3U);
  const std::size_t size = size_of(format);
  if (values.size() > kMax) {
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
  b[20] = p.fix;
  b[21] = p.flags;
  b[22] = p.satellites;
  write_u32(std::span(b).subspan(40), p.horizontal_accuracy_mm);
  write_u32(std::span(b).subspan(44), p.vertical_accuracy_mm);
  write_u32(std::span(b).subspan(68), p.speed_accuracy_mm_s);
  write_u16(std::span(b).subspan(82), p.position_dop_1e2);
  put(wire_id(PacketId::gnss_pvt), b);
}

bool decode_mtdata2(Bytes payload, Mtdata2* out) noexcept {
  Mtdata2 decoded;
  PacketReader reader(payload);
  for (Packet packet; reader.next(&packet);) decode(packet, &decoded);
  if (!reader.truncated()) *out = decoded;
  return !reader.truncated();
}

}  // namespace vergence::xbus
