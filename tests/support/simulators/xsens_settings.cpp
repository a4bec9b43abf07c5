#include "tests/support/simulators/xsens_settings.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace vergence::test {
namespace {

using namespace xbus;

/// Hz, of an MTi-G-700/710.
constexpr std::array<std::uint16_t, 15> kRates{1,  2,  4,  5,  8,   10,  16, 20,
                                               25, 40, 50, 80, 100, 200, 400};

/// The rate that the device takes for the one asked for.
std::uint16_t rate_taken(std::uint16_t asked) noexcept {
  std::uint16_t best = kRates[0];
  for (const std::uint16_t r : kRates)
    if (std::abs(int{r} - int{asked}) < std::abs(int{best} - int{asked})) best = r;
  return best;
}

OutputConfiguration factory_outputs() noexcept {
  OutputConfiguration o;
  for (const OutputEntry e : {OutputEntry{0x1020, kEveryMessage},
                              {0x1060, kEveryMessage},
                              {0x2030, 100},
                              {0x4020, 100},
                              {0x8020, 100},
                              {0xE020, kEveryMessage}})
    (void)o.add(e);
  return o;
}

[[nodiscard]] std::uint8_t id_of(MessageId id) noexcept { return static_cast<std::uint8_t>(id); }

/// The acknowledgement of a message.
[[nodiscard]] XsensSettings::Reply answer(const Message& m, std::span<const std::uint8_t> payload) {
  return {static_cast<std::uint8_t>(m.id + 1), {payload.begin(), payload.end()}};
}

}  // namespace

XsensSettings::XsensSettings(const XsensSimulatorOptions& options)
    : generation_(options.generation),
      device_id_(options.device_id),
      stored_baud_(options.baud),
      outputs_(options.outputs.count > 0 ? options.outputs : factory_outputs()),
      layout_(options.layout),
      period_(options.period) {
  // The receiver's clock, on by default.
  sync_.entries[sync_.count++] = {14, 1, 1, 0, 0, 0, 0, 0};
}

std::int64_t XsensSettings::period_ns() const noexcept {
  if (legacy())
    return static_cast<std::int64_t>(period_) * (skip_ + 1) * 1'000'000'000 / kPeriodClock;
  std::uint16_t rate = 0;
  for (const OutputEntry& e : outputs_.items())
    if (e.rate_hz != kEveryMessage && (e.id & 0xF000U) != 0x7000U) rate = std::max(rate, e.rate_hz);
  return rate == 0 ? 1'000'000'000 : 1'000'000'000 / rate;
}

double XsensSettings::line_load(std::uint32_t baud) const noexcept {
  return legacy() ? line_budget(layout_, rate_hz(), baud).load : line_budget(outputs_, baud).load;
}

XsensSettings::Reply XsensSettings::refuse(std::uint8_t code) {
  ++writes_.refused;
  return {id_of(MessageId::error), {code}};
}

XsensSettings::Reply XsensSettings::handle(const Message& m) {
  std::array<std::uint8_t, kMaxPayload> payload{};
  switch (static_cast<MessageId>(m.id)) {
    case MessageId::device_id_request:
    case MessageId::init_bus:
      write_u32(payload, device_id_);
      return answer(m, std::span(payload).first(4));
    case MessageId::product_code_request: {
      constexpr std::string_view kLegacyCode = "MTi-G-28A53G35      ",
                                 kCode = "MTI-G-710-2A8G4     ";
      const std::string_view code = legacy() ? kLegacyCode : kCode;
      std::copy(code.begin(), code.end(), payload.begin());
      return answer(m, std::span(payload).first(code.size()));
    }
    case MessageId::firmware_request:
      payload[0] = legacy() ? 2 : 1;
      payload[1] = legacy() ? 6 : 8;
      payload[2] = 1;
      return answer(m, std::span(payload).first(legacy() ? 3 : 11));
    case MessageId::configuration_request:
      write_configuration(configuration(), payload);
      return answer(m, std::span(payload).first(kConfigurationSize));
    case MessageId::baudrate: {
      if (m.payload.size() == 1) {
        const auto baud = baud_of_code(m.payload[0]);
        if (!baud) return refuse(0x20);
        stored_baud_ = *baud;
        ++writes_.baud;
      }
      payload[0] = baud_code(stored_baud_, generation_).value_or(0);
      return answer(
          m, m.payload.size() == 1 ? std::span<const std::uint8_t>{} : std::span(payload).first(1));
    }
    default:
      return legacy() ? handle_legacy(m) : handle_mark4(m);
  }
}

XsensSettings::Reply XsensSettings::answer_u16(const Message& m, std::uint16_t* setting,
                                               int* writes) {
  std::array<std::uint8_t, 2> now{};
  if (m.payload.size() == 2) {
    *setting = read_u16(m.payload);
    ++*writes;
    return answer(m, {});
  }
  if (!m.payload.empty()) return refuse(kErrorParameter);
  write_u16(now, *setting);
  return answer(m, now);
}

XsensSettings::Reply XsensSettings::handle_legacy(const Message& m) {
  std::array<std::uint8_t, 8> payload{};
  switch (static_cast<MessageId>(m.id)) {
    case MessageId::period:
      if (m.payload.size() == 2 && (read_u16(m.payload) < 225 || read_u16(m.payload) > 11520))
        return refuse(0x03);
      return answer_u16(m, &period_, &writes_.period);
    case MessageId::output_skip:
      return answer_u16(m, &skip_, &writes_.skip);
    case MessageId::output_mode:
      return answer_u16(m, &layout_.mode, &writes_.layout);
    case MessageId::output_settings:
      if (m.payload.size() == 4) {
        layout_.settings = read_u32(m.payload);
        ++writes_.layout;
        return answer(m, {});
      }
      write_u32(payload, layout_.settings);
      return answer(m, std::span(payload).first(4));
    case MessageId::data_length_request:
      write_u16(payload, static_cast<std::uint16_t>(layout_.payload_size().value_or(0)));
      return answer(m, std::span(payload).first(2));
    case MessageId::legacy_sync_out: {
      LegacySync parameter{};
      std::uint32_t value = 0;
      if (read_legacy_sync(m.payload, &parameter, &value)) {
        legacy_sync_out_[static_cast<std::size_t>(parameter)] = value;
        ++writes_.sync_out;
        return answer(m, {});
      }
      if (m.payload.size() != 1 || m.payload[0] > 3) return refuse(kErrorParameter);
      const std::size_t n = write_legacy_sync(static_cast<LegacySync>(m.payload[0]),
                                              legacy_sync_out_[m.payload[0]], payload);
      return answer(m, std::span(payload).first(n));
    }
    default:
      return refuse(kErrorMessageUnknown);
  }
}

XsensSettings::Reply XsensSettings::handle_mark4(const Message& m) {
  std::array<std::uint8_t, 4 * kMaxOutputs + kMaxSyncEntries * kSyncEntrySize> payload{};
  switch (static_cast<MessageId>(m.id)) {
    case MessageId::output_configuration: {
      OutputConfiguration asked;
      if (!m.payload.empty()) {
        if (!read_output_configuration(m.payload, &asked)) return refuse(kErrorParameter);
        for (std::size_t i = 0; i < asked.count; ++i)
          if (asked.entries[i].rate_hz != kEveryMessage)
            asked.entries[i].rate_hz = rate_taken(asked.entries[i].rate_hz);
        outputs_ = asked;
        ++writes_.outputs;
      }
      return answer(m, std::span(payload).first(write_output_configuration(outputs_, payload)));
    }
    case MessageId::sync_settings:
      if (!m.payload.empty()) {
        if (!read_sync_settings(m.payload, &sync_)) return refuse(kErrorParameter);
        ++writes_.sync_settings;
      }
      return answer(m, std::span(payload).first(write_sync_settings(sync_, payload)));
    case MessageId::string_output: {
      int ignored = 0;
      return answer_u16(m, &string_output_, &ignored);
    }
    case MessageId::legacy_sync_in:
      ++writes_.heading;
      return answer(m, {});
    default:
      return refuse(kErrorMessageUnknown);
  }
}

DeviceConfiguration XsensSettings::configuration() const noexcept {
  DeviceConfiguration c;
  c.master_id = c.device_id = device_id_;
  c.period = period_;
  c.output_skip = skip_;
  c.devices = 1;
  c.output_mode = layout_.mode;
  c.output_settings = layout_.settings;
  c.data_length = static_cast<std::uint16_t>(layout_.payload_size().value_or(0));
  c.scenario = scenario_;
  c.firmware = {2, 6, 1};
  return c;
}

bool XsensSettings::sync_out_within(std::int64_t from_ns, std::int64_t to_ns) const noexcept {
  for (const SyncEntry& e : sync_.items()) {
    if (e.function != kSyncIntervalTransition || e.line != kSyncLineOut || e.polarity == 0)
      continue;
    const auto period = static_cast<std::int64_t>(1e9 / kSyncOutBase) * (e.skip + 1);
    if (to_ns / period != from_ns / period) return true;
  }
  return false;
}

}  // namespace vergence::test
