#include "firmware_iface/xbus/mtdata.hpp"

#include <algorithm>
#include <cmath>

namespace vergence::xbus {
namespace {

constexpr std::size_t kRawSize = 20;
// Air pressure, time, position and velocity of a fix.
constexpr std::size_t kBeforeAccuracies = 31;
constexpr std::uint16_t kModesKnown = kModeTemperature | kModeCalibrated | kModeOrientation |
                                      kModeAuxiliary | kModePosition | kModeVelocity | kModeStatus |
                                      kModeGnss | kModeRaw;
constexpr std::uint32_t kOrientationBits = 0xC;
// 0 means latitude, longitude and altitude on WGS 84.
constexpr std::uint32_t kPlaceBits = 0x7U << 14U;
// 0 means m/s along x, y, z.
constexpr std::uint32_t kSpeedBits = 0x3U << 17U;

/// Walks a payload in the layout's order; reading and writing differ only in what happens to a
/// field. `Fields` has fix(), numbers(span of doubles by optional), u8(), u16(), utc(): each takes
/// the optional it belongs to; skip() takes the bytes of what no INS sample is made of.
template <class Data, class Fields>
void walk(const MtdataLayout& layout, Data& d, Fields& fields) noexcept {
  const std::uint16_t m = layout.mode;
  const std::uint32_t s = layout.settings;
  if ((m & kModeRaw) != 0) fields.skip(kRawSize);
  if ((m & kModeGnss) != 0) fields.fix(d.fix);
  const std::size_t number_size = size_of(layout.format());
  if ((m & kModeTemperature) != 0) fields.skip(number_size);
  if ((m & kModeCalibrated) != 0)
    for (const std::uint32_t left_out :
         {kSettingsNoAcceleration, kSettingsNoRateOfTurn, kSettingsNoMagneticField})
      if ((s & left_out) == 0) fields.skip(3 * number_size);
  if ((m & kModeOrientation) != 0) {
    if ((s & kOrientationBits) == kSettingsQuaternion) fields.numbers(d.quaternion);
    if ((s & kOrientationBits) == kSettingsEuler) fields.numbers(d.euler_deg);
    if ((s & kOrientationBits) == kSettingsMatrix) fields.numbers(d.rotation_matrix);
  }
  if ((m & kModeAuxiliary) != 0)
    for (const std::uint32_t left_out : {kSettingsNoAnalogue1, kSettingsNoAnalogue2})
      if ((s & left_out) == 0) fields.skip(2);
  if ((m & kModePosition) != 0) {
    fields.numbers(d.latitude_longitude_deg);
    fields.number(d.altitude_m);
  }
  if ((m & kModeVelocity) != 0) fields.numbers(d.velocity);
  if ((m & kModeStatus) != 0) fields.u8(d.status);
  if ((s & kSettingsCounter) != 0) fields.u16(d.sample_counter);
  if ((s & kSettingsUtc) != 0) fields.utc(d.utc);
}

/// Counts bytes.
struct Sizes {
  std::size_t number_size;
  std::size_t total = 0;
  void skip(std::size_t bytes) noexcept { total += bytes; }
  void fix(const std::optional<LegacyFix>& /*field*/) noexcept { total += kBeforeAccuracies + 13; }
  void number(const std::optional<double>& /*field*/) noexcept { total += number_size; }
  template <std::size_t N>
  void numbers(const std::optional<std::array<double, N>>& /*field*/) noexcept {
    total += N * number_size;
  }
  void u8(const std::optional<std::uint8_t>& /*field*/) noexcept { total += 1; }
  void u16(const std::optional<std::uint16_t>& /*field*/) noexcept { total += 2; }
  void utc(const std::optional<Utc>& /*field*/) noexcept { total += kUtcSize; }
};

/// Reads fields from bytes of which there are enough.
struct Reader {
  std::span<const std::uint8_t> rest;
  NumberFormat format;
  bool finite = true;

  std::span<const std::uint8_t> read(std::size_t n) noexcept {
    const auto bytes = rest.first(n);
    rest = rest.subspan(n);
    return bytes;
  }
  std::uint16_t next_u16() noexcept { return read_u16(read(2)); }
  std::uint32_t next_u32() noexcept { return read_u32(read(4)); }
  double next_number() noexcept {
    const double value = read_number(read(size_of(format)), format);
    finite = finite && std::isfinite(value);
    return value;
  }
  void skip(std::size_t bytes) noexcept { (void)read(bytes); }
  void fix(std::optional<LegacyFix>& field) noexcept {
    skip(kBeforeAccuracies);
    LegacyFix f;
    f.horizontal_accuracy_mm = next_u32();
    f.vertical_accuracy_mm = next_u32();
    f.speed_accuracy_cm_s = next_u32();
    f.age = read(1)[0];
    field = f;
  }
  void number(std::optional<double>& field) noexcept { field = next_number(); }
  template <std::size_t N>
  void numbers(std::optional<std::array<double, N>>& field) noexcept {
    std::array<double, N> values{};
    for (double& value : values) value = next_number();
    field = values;
  }
  void u8(std::optional<std::uint8_t>& field) noexcept { field = read(1)[0]; }
  void u16(std::optional<std::uint16_t>& field) noexcept { field = next_u16(); }
  void utc(std::optional<Utc>& field) noexcept { field = read_utc(read(kUtcSize)); }
};

/// Puts fields into bytes of which there are enough.
struct Writer {
  std::span<std::uint8_t> rest;
  NumberFormat format;

  std::span<std::uint8_t> room(std::size_t n) noexcept {
    const auto bytes = rest.first(n);
    rest = rest.subspan(n);
    return bytes;
  }
  void skip(std::size_t bytes) noexcept {
    const auto zeros = room(bytes);
    std::fill(zeros.begin(), zeros.end(), std::uint8_t{0});
  }
  void fix(const std::optional<LegacyFix>& field) noexcept {
    const LegacyFix f = field.value_or(LegacyFix{});
    skip(kBeforeAccuracies);
    for (const std::uint32_t v :
         {f.horizontal_accuracy_mm, f.vertical_accuracy_mm, f.speed_accuracy_cm_s})
      write_u32(room(4), v);
    room(1)[0] = f.age;
  }
  void number(const std::optional<double>& field) noexcept {
    write_number(room(size_of(format)), format, field.value_or(0));
  }
  template <std::size_t N>
  void numbers(const std::optional<std::array<double, N>>& field) noexcept {
    for (const double value : field.value_or(std::array<double, N>{}))
      write_number(room(size_of(format)), format, value);
  }
  void u8(const std::optional<std::uint8_t>& field) noexcept { room(1)[0] = field.value_or(0); }
  void u16(const std::optional<std::uint16_t>& field) noexcept {
    write_u16(room(2), field.value_or(0));
  }
  void utc(const std::optional<Utc>& field) noexcept {
    write_utc(room(kUtcSize), field.value_or(Utc{}));
  }
};

}  // namespace

std::optional<std::size_t> MtdataLayout::payload_size() const noexcept {
  if ((mode & static_cast<std::uint16_t>(~kModesKnown)) != 0) return std::nullopt;
  if ((mode & kModeRaw) != 0 && (mode & static_cast<std::uint16_t>(~(kModeRaw | kModeGnss))) != 0)
    return std::nullopt;
  if ((mode & kModeOrientation) != 0 && (settings & kOrientationBits) == kOrientationBits)
    return std::nullopt;
  if ((mode & kModePosition) != 0 && (settings & kPlaceBits) != 0) return std::nullopt;
  if ((mode & kModeVelocity) != 0 && (settings & kSpeedBits) != 0) return std::nullopt;
  Sizes sizes{size_of(format())};
  const Mtdata nothing;
  walk(*this, nothing, sizes);
  return sizes.total;
}

bool decode_mtdata(std::span<const std::uint8_t> payload, const MtdataLayout& layout,
                   Mtdata* out) noexcept {
  const std::optional<std::size_t> size = layout.payload_size();
  if (size != payload.size()) return false;
  Mtdata decoded;
  decoded.frame = layout.frame();
  decoded.format = layout.format();
  Reader reader{payload, layout.format()};
  walk(layout, decoded, reader);
  if (reader.finite) *out = decoded;
  return reader.finite;
}

std::size_t encode_mtdata(const Mtdata& data, const MtdataLayout& layout,
                          std::span<std::uint8_t> out) noexcept {
  const std::optional<std::size_t> size = layout.payload_size();
  if (!size || *size > out.size()) return 0;
  Writer writer{out.first(*size), layout.format()};
  walk(layout, data, writer);
  return *size;
}

}  // namespace vergence::xbus
