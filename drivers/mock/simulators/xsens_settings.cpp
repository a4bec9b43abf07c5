#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/mock/simulators/xsens_simulator.hpp"

/// What the host asks of a device in its configuration state, and the answers.
namespace vergence::mock {
namespace {

using namespace xbus;

constexpr std::array<std::uint16_t, 15> kRates{
    1, 2, 4, 5, 8, 10, 16, 20, 25, 40, 50, 80, 100, 200, 400};  // Hz, of an MTi-G-700/710

/// The rate that the device takes for the one asked for.
std::uint16_t rate_taken(std::uint16_t asked) noexcept {
  std::uint16_t best = kRates[0];
  for (const std::uint16_t r : kRates)
    if (std::abs(int{r} - int{asked}) < std::abs(int{best} - int{asked})) best = r;
  return best;
}

}  // namespace

void XsensSimulator::handle_setting(const Message& m) {
  std::array<std::uint8_t, kMaxPayload> payload{};
  switch (static_cast<MessageId>(m.id)) {
    case MessageId::go_to_measurement: {
      const double load = legacy() ? line_budget(layout_, rate_hz(), baud_).load
                                   : line_budget(outputs_, baud_).load;
      constexpr std::uint8_t kTooMuch = 0x29;
      if (load > 1) return refuse(kTooMuch);
      if (legacy()) send_configuration(now_ + kAnswerTime);
      answer(m.id + 1, {});
      measure(now_ + kAnswerTime);
      return;
    }
    case MessageId::device_id_request:
    case MessageId::init_bus:
      write_u32(payload, options_.device_id);
      return answer(m.id + 1, std::span(payload).first(4));
    case MessageId::product_code_request: {
      constexpr std::string_view kLegacyCode = "MTi-G-28A53G35      ",
                                 kCode = "MTI-G-710-2A8G4     ";
      const std::string_view code = legacy() ? kLegacyCode : kCode;
      std::copy(code.begin(), code.end(), payload.begin());
      return answer(m.id + 1, std::span(payload).first(code.size()));
    }
    case MessageId::firmware_request:
      payload[0] = legacy() ? 2 : 1;
      payload[1] = legacy() ? 6 : 8;
      payload[2] = 1;
      return answer(m.id + 1, std::span(payload).first(legacy() ? 3 : 11));
    case MessageId::configuration_request:
      write_configuration(configuration(), payload);
      return answer(m.id + 1, std::span(payload).first(kConfigurationSize));
    case MessageId::baudrate: {
      if (m.payload.size() == 1) {
        const auto baud = baud_of_code(m.payload[0]);
        if (!baud) return refuse(0x20);
        stored_baud_ = *baud;
        ++writes_.baud;
      }
      payload[0] = baud_code(stored_baud_, options_.generation).value_or(0);
      return answer(m.id + 1, m.payload.size() == 1 ? std::span<const std::uint8_t>{}
                                                    : std::span(payload).first(1));
    }
    default:
      return legacy() ? handle_legacy(m) : handle_mark4(m);
  }
}

void XsensSimulator::answer_u16(const Message& m, std::uint16_t* setting, int* writes) {
  std::array<std::uint8_t, 2> now{};
  if (m.payload.size() == 2) {
    *setting = read_u16(m.payload);
    ++*writes;
    return answer(m.id + 1, {});
  }
  if (!m.payload.empty()) return refuse(kErrorParameter);
  write_u16(now, *setting);
  answer(m.id + 1, now);
}

void XsensSimulator::handle_legacy(const Message& m) {
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
        return answer(m.id + 1, {});
      }
      write_u32(payload, layout_.settings);
      return answer(m.id + 1, std::span(payload).first(4));
    case MessageId::data_length_request:
      write_u16(payload, static_cast<std::uint16_t>(layout_.payload_size().value_or(0)));
      return answer(m.id + 1, std::span(payload).first(2));
    case MessageId::legacy_sync_in:
    case MessageId::legacy_sync_out: {
      auto& settings = m.is(MessageId::legacy_sync_in) ? legacy_sync_in_ : legacy_sync_out_;
      LegacySync parameter{};
      std::uint32_t value = 0;
      if (read_legacy_sync(m.payload, &parameter, &value)) {
        settings[static_cast<std::size_t>(parameter)] = value;
        ++(m.is(MessageId::legacy_sync_in) ? writes_.sync_in : writes_.sync_out);
        return answer(m.id + 1, {});
      }
      if (m.payload.size() != 1 || m.payload[0] > 3) return refuse(kErrorParameter);
      const std::size_t n =
          write_legacy_sync(static_cast<LegacySync>(m.payload[0]), settings[m.payload[0]], payload);
      return answer(m.id + 1, std::span(payload).first(n));
    }
    default:
      return refuse(kErrorMessageUnknown);
  }
}

void XsensSimulator::handle_mark4(const Message& m) {
  std::array<std::uint8_t, 4 * kMostOutputs + kMostSyncEntries * kSyncEntrySize> payload{};
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
      return answer(m.id + 1,
                    std::span(payload).first(write_output_configuration(outputs_, payload)));
    }
    case MessageId::sync_settings:
      if (!m.payload.empty()) {
        if (!read_sync_settings(m.payload, &sync_)) return refuse(kErrorParameter);
        ++writes_.sync_settings;
      }
      return answer(m.id + 1, std::span(payload).first(write_sync_settings(sync_, payload)));
    case MessageId::string_output: {
      int ignored = 0;
      return answer_u16(m, &string_output_, &ignored);
    }
    case MessageId::legacy_sync_in:
      ++writes_.heading;
      return answer(m.id + 1, {});
    default:
      return refuse(kErrorMessageUnknown);
  }
}

DeviceConfiguration XsensSimulator::configuration() const noexcept {
  DeviceConfiguration c;
  c.master_id = c.device_id = options_.device_id;
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

void XsensSimulator::send_configuration(HostStamp at) {
  std::array<std::uint8_t, kConfigurationSize> payload{};
  write_configuration(configuration(), payload);
  send(at, id_of(MessageId::configuration), payload);
}

}  // namespace vergence::mock
