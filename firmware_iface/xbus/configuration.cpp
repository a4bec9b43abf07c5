#include "firmware_iface/xbus/configuration.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_iface/xbus/bytes.hpp"

namespace vergence::xbus {
namespace {

struct BaudCode {
  std::uint32_t baud;
  std::uint8_t code;
};
constexpr std::array<BaudCode, 14> kBaudCodes{{{460800, 0x00},
                                               {230400, 0x01},
                                               {115200, 0x02},
                                               {76800, 0x03},
                                               {57600, 0x04},
                                               {38400, 0x05},
                                               {28800, 0x06},
                                               {19200, 0x07},
                                               {14400, 0x08},
                                               {9600, 0x09},
                                               {921600, 0x0A},
                                               {4800, 0x0B},
                                               {2000000, 0x0C},
                                               {921600, 0x80}}};
constexpr std::uint8_t kOldCode921600 = 0x80;

/// Rates that the receiver's pulse cannot correct.
constexpr std::array<std::uint16_t, 11> kRatesExcluded{10, 15, 18,  25,  45, 50,
                                                       75, 90, 150, 225, 450};

}  // namespace

std::optional<std::uint8_t> baud_code(std::uint32_t baud, Generation generation) noexcept {
  if (baud == 921600 && generation == Generation::legacy) return kOldCode921600;
  if (baud == 2000000 && generation == Generation::legacy) return std::nullopt;
  const auto* found = std::find_if(kBaudCodes.begin(), kBaudCodes.end(),
                                   [baud](const BaudCode& b) { return b.baud == baud; });
  return found == kBaudCodes.end() ? std::nullopt : std::optional(found->code);
}

std::optional<std::uint32_t> baud_of_code(std::uint8_t code) noexcept {
  const auto* found = std::find_if(kBaudCodes.begin(), kBaudCodes.end(),
                                   [code](const BaudCode& b) { return b.code == code; });
  return found == kBaudCodes.end() ? std::nullopt : std::optional(found->baud);
}

std::optional<std::uint16_t> period_of_rate(double rate_hz) noexcept {
  // In Hz.
  constexpr double kMin = 10, kMax = 512;
  if (!(rate_hz >= kMin && rate_hz <= kMax)) return std::nullopt;
  const double period = std::round(kPeriodClock / rate_hz);
  if (std::abs(kPeriodClock / period - rate_hz) > 1e-6 * rate_hz) return std::nullopt;
  if (std::any_of(kRatesExcluded.begin(), kRatesExcluded.end(),
                  [rate_hz](std::uint16_t r) { return std::abs(rate_hz - r) < 1e-3; }))
    return std::nullopt;
  return static_cast<std::uint16_t>(period);
}

bool read_configuration(std::span<const std::uint8_t> payload, DeviceConfiguration* out) noexcept {
  if (payload.size() < kConfigurationSize) return false;
  const auto u16 = [payload](std::size_t at) { return read_u16(payload.subspan(at)); };
  const auto u32 = [payload](std::size_t at) { return read_u32(payload.subspan(at)); };
  if (u16(96) != 1) return false;
  *out = {u32(0),
          u16(4),
          u16(6),
          u16(8),
          u16(10),
          u32(12),
          u16(96),
          u32(98),
          u16(102),
          u16(104),
          u32(106),
          u16(110),
          {payload[112], payload[113], payload[114]}};
  return true;
}

void write_configuration(const DeviceConfiguration& c, std::span<std::uint8_t> out) noexcept {
  std::fill_n(out.begin(), kConfigurationSize, std::uint8_t{0});
  const auto u16 = [out](std::size_t at, std::uint16_t v) { write_u16(out.subspan(at), v); };
  const auto u32 = [out](std::size_t at, std::uint32_t v) { write_u32(out.subspan(at), v); };
  u32(0, c.master_id);
  u16(4, c.period);
  u16(6, c.output_skip);
  u16(8, c.sync_in_mode);
  u16(10, c.sync_in_skip);
  u32(12, c.sync_in_offset);
  u16(96, c.devices);
  u32(98, c.device_id);
  u16(102, c.data_length);
  u16(104, c.output_mode);
  u32(106, c.output_settings);
  u16(110, c.scenario);
  std::copy(c.firmware.begin(), c.firmware.end(), out.begin() + 112);
}

bool OutputConfiguration::operator==(const OutputConfiguration& o) const noexcept {
  return std::equal(items().begin(), items().end(), o.items().begin(), o.items().end());
}

bool read_output_configuration(std::span<const std::uint8_t> payload,
                               OutputConfiguration* out) noexcept {
  constexpr std::size_t kEntry = 4;
  if (payload.size() % kEntry != 0 || payload.size() / kEntry > kMaxOutputs) return false;
  OutputConfiguration read;
  for (; !payload.empty(); payload = payload.subspan(kEntry))
    (void)read.add({read_u16(payload), read_u16(payload.subspan(2))});
  *out = read;
  return true;
}

std::size_t write_output_configuration(const OutputConfiguration& configuration,
                                       std::span<std::uint8_t> out) noexcept {
  constexpr std::size_t kEntry = 4;
  if (out.size() < configuration.count * kEntry) return 0;
  for (std::size_t i = 0; i < configuration.count; ++i) {
    write_u16(out.subspan(i * kEntry), configuration.entries[i].id);
    write_u16(out.subspan(i * kEntry + 2), configuration.entries[i].rate_hz);
  }
  return configuration.count * kEntry;
}

std::size_t write_legacy_sync(LegacySync parameter, std::uint32_t value,
                              std::span<std::uint8_t> out) noexcept {
  const bool wide = parameter == LegacySync::offset || parameter == LegacySync::width;
  const std::size_t size = wide ? 5 : 3;
  if (out.size() < size) return 0;
  out[0] = static_cast<std::uint8_t>(parameter);
  if (wide)
    write_u32(out.subspan(1), value);
  else
    write_u16(out.subspan(1), static_cast<std::uint16_t>(value));
  return size;
}

bool read_legacy_sync(std::span<const std::uint8_t> payload, LegacySync* parameter,
                      std::uint32_t* value) noexcept {
  if (payload.empty() || payload[0] > static_cast<std::uint8_t>(LegacySync::width)) return false;
  const auto which = static_cast<LegacySync>(payload[0]);
  const bool wide = which == LegacySync::offset || which == LegacySync::width;
  if (payload.size() != (wide ? 5U : 3U)) return false;
  *parameter = which;
  *value = wide ? read_u32(payload.subspan(1)) : read_u16(payload.subspan(1));
  return true;
}

bool SyncSettings::operator==(const SyncSettings& o) const noexcept {
  return std::equal(items().begin(), items().end(), o.items().begin(), o.items().end());
}

bool read_sync_settings(std::span<const std::uint8_t> payload, SyncSettings* out) noexcept {
  if (payload.size() % kSyncEntrySize != 0 || payload.size() / kSyncEntrySize > kMaxSyncEntries)
    return false;
  SyncSettings read;
  for (; !payload.empty(); payload = payload.subspan(kSyncEntrySize))
    read.entries[read.count++] = {payload[0],
                                  payload[1],
                                  payload[2],
                                  payload[3],
                                  read_u16(payload.subspan(4)),
                                  read_u16(payload.subspan(6)),
                                  read_u16(payload.subspan(8)),
                                  static_cast<std::int16_t>(read_u16(payload.subspan(10)))};
  *out = read;
  return true;
}

std::size_t write_sync_settings(const SyncSettings& settings,
                                std::span<std::uint8_t> out) noexcept {
  if (out.size() < settings.count * kSyncEntrySize) return 0;
  for (const SyncEntry& e : settings.items()) {
    out[0] = e.function;
    out[1] = e.line;
    out[2] = e.polarity;
    out[3] = e.once;
    write_u16(out.subspan(4), e.skip_first);
    write_u16(out.subspan(6), e.skip);
    write_u16(out.subspan(8), e.width);
    write_u16(out.subspan(10), static_cast<std::uint16_t>(e.delay));
    out = out.subspan(kSyncEntrySize);
  }
  return settings.count * kSyncEntrySize;
}

std::uint16_t sync_out_skip(double base_hz, double rate_hz, double* actual_hz) noexcept {
  const double divisor = std::clamp(std::round(base_hz / rate_hz), 1.0, 65536.0);
  *actual_hz = base_hz / divisor;
  return static_cast<std::uint16_t>(divisor - 1);
}

std::string_view error_text(std::uint8_t code) noexcept {
  switch (code) {
    case 0x03:
      return "the period is not within the device's range";
    case kErrorMessageUnknown:
      return "the message is not known to this device";
    case 0x1E:
      return "the timer overflowed: the rate is too high for the output asked for";
    case 0x20:
      return "the baud rate is not one of the device's";
    case kErrorParameter:
      return "a parameter is outside its range";
    case 0x23:
      return "the transmit buffer is full: the line is too slow for the output";
    case 0x28:
      return "the device reports a fault of its own";
    case 0x29:
      return "more data is asked for than the line carries";
    case 0x2A:
      return "the sample buffer is full";
    case 0x2B:
      return "the external trigger is not at the configured rate";
    case kErrorPowerDip:
      return "the supply dipped and recovered";
    case 0x32:
      return "the settings in the device's memory are not valid";
    default:
      return "an error this program has no words for";
  }
}

}  // namespace vergence::xbus
