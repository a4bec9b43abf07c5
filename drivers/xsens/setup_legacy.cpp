#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/xsens/detail/format_text.hpp"
#include "drivers/xsens/setup.hpp"

/// Settings of an MTi-G: period, output mode and settings, lines by parameter.
namespace vergence::xsens {
namespace {

using namespace xbus;

// What the program wants of an MTi-G: fixed point 16.32, so that a position keeps its digits; X
// north, Y west, Z up as it comes.
constexpr std::uint16_t kLegacyMode =
    kModeOrientation | kModePosition | kModeVelocity | kModeStatus;
constexpr std::uint32_t kLegacySettings =
    settings_format(NumberFormat::fp16_32) | kSettingsQuaternion | kSettingsCounter | kSettingsUtc;

}  // namespace

DeviceStatus Setup::set_legacy(double rate_hz, StreamSettings* stream) {
  const auto period = period_of_rate(rate_hz);
  if (!period) {
    last_error_ = format_text(
        "an MTi-G has no %.6g Hz: its rates divide 115200 Hz, from 10 to 512, without those that "
        "its receiver cannot correct; "
        "set ins.rate to 100 or 120",
        rate_hz);
    return DeviceStatus::unsupported;
  }
  // With the receiver's own fix where the line has room for it.
  MtdataLayout layout{static_cast<std::uint16_t>(kLegacyMode | kModeGnss), kLegacySettings};
  if (!line_budget(layout, rate_hz, baud_to_be()).fits()) layout.mode = kLegacyMode;
  if (!line_budget(layout, rate_hz, baud_to_be()).fits()) layout.settings &= ~kSettingsUtc;
  const LineBudget budget = line_budget(layout, rate_hz, baud_to_be());
  if (!budget.fits()) return refuse_load(budget, rate_hz, baud_to_be());

  if (const DeviceStatus s =
          write(MessageId::configuration_request, {}, "the question for its configuration");
      s != DeviceStatus::ok)
    return s;
  DeviceConfiguration has;
  if (!read_configuration(reply_.bytes(), &has)) {
    last_error_ = "its configuration cannot be read: is more than one device on the bus?";
    return DeviceStatus::unsupported;
  }
  std::array<std::uint8_t, 4> bytes{};
  const auto u16 = [&bytes](std::uint16_t v) {
    return write_u16(bytes, v), std::span<const std::uint8_t>(bytes).first(2);
  };
  DeviceStatus s = DeviceStatus::ok;
  if (has.period != *period) s = write(MessageId::period, u16(*period), "the sample period");
  if (s == DeviceStatus::ok && has.output_skip != 0)
    s = write(MessageId::output_skip, u16(0), "the output skip factor");
  if (s == DeviceStatus::ok && has.output_mode != layout.mode)
    s = write(MessageId::output_mode, u16(layout.mode), "the output mode");
  if (s == DeviceStatus::ok && has.output_settings != layout.settings) {
    write_u32(bytes, layout.settings);
    s = write(MessageId::output_settings, bytes, "the output settings");
  }
  if (s == DeviceStatus::ok)
    s = write(MessageId::data_length_request, {}, "the question for its message's length");
  if (s != DeviceStatus::ok) return s;
  if (reply_.size != 2 || read_u16(reply_.bytes()) != layout.payload_size()) {
    last_error_ = format_text(
        "its messages have %u bytes where its settings mean %zu: this firmware is not known",
        reply_.size == 2 ? unsigned{read_u16(reply_.bytes())} : 0U,
        layout.payload_size().value_or(0));
    return DeviceStatus::unsupported;
  }
  stream->layout = layout;
  stream->period_numerator = *period;
  stream->period_denominator = kPeriodClock;
  return set_legacy_lines(rate_hz, stream);
}

DeviceStatus Setup::set_legacy_line(MessageId id, LegacySync parameter, std::uint32_t value) {
  const std::uint8_t which = static_cast<std::uint8_t>(parameter);
  if (const DeviceStatus s = write(id, {&which, 1}, "the question for a synchronisation line");
      s != DeviceStatus::ok)
    return s;
  LegacySync stored{};
  std::uint32_t has = 0;
  if (read_legacy_sync(reply_.bytes(), &stored, &has) && stored == parameter && has == value)
    return DeviceStatus::ok;
  std::array<std::uint8_t, 5> bytes{};
  return write(id, std::span(bytes).first(write_legacy_sync(parameter, value, bytes)),
               "a setting of a synchronisation line");
}

DeviceStatus Setup::set_legacy_lines(double rate_hz, StreamSettings* stream) {
  const auto out = [this](LegacySync p, std::uint32_t v) {
    return set_legacy_line(MessageId::legacy_sync_out, p, v);
  };
  if (options_.sync_out_hz < 0) {
    if (const DeviceStatus s = out(LegacySync::mode, kLegacySyncOutOff); s != DeviceStatus::ok)
      return s;
  } else if (options_.sync_out_hz > 0) {
    double actual = 0;
    const std::uint16_t skip = sync_out_skip(rate_hz, options_.sync_out_hz, &actual);
    const auto width = static_cast<std::uint32_t>(std::lround(
        std::clamp(options_.sync_out_width_ms, 0.01, 1000.0) * 1e-3 * kLegacySyncClock));
    for (const auto& [parameter, value] :
         {std::pair<LegacySync, std::uint32_t>{LegacySync::skip, skip},
          {LegacySync::offset, 0},
          {LegacySync::width, width},
          {LegacySync::mode, kLegacySyncOutPulse | kLegacySyncOutPositive}})
      if (const DeviceStatus s = out(parameter, value); s != DeviceStatus::ok) return s;
    stream->sync_out_hz = actual;
  }
  if (options_.sync_in == SyncIn::leave) return DeviceStatus::ok;
  constexpr std::uint16_t kSendLatest = 4, kRising = 1, kFalling = 2;
  const std::uint16_t mode =
      options_.sync_in == SyncIn::off
          ? std::uint16_t{0}
          : static_cast<std::uint16_t>(kSendLatest |
                                       (options_.sync_in == SyncIn::rising ? kRising : kFalling));
  return set_legacy_line(MessageId::legacy_sync_in, LegacySync::mode, mode);
}

}  // namespace vergence::xsens
