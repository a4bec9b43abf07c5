#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/xsens/setup.hpp"

/// Settings of an MTi-G-700/710: output configuration, list of synchronisation settings.
namespace vergence::xsens {
namespace {

using namespace xbus;

/// What the program wants of an MTi-G-700/710. Without UTC it still has the receiver's.
OutputConfiguration requested_outputs(std::uint16_t rate_hz, bool utc) noexcept {
  OutputConfiguration o;
  if (utc) (void)o.add({wire_id(PacketId::utc), kEveryMessage});
  for (const OutputEntry e :
       {OutputEntry{wire_id(PacketId::packet_counter), kEveryMessage},
        {wire_id(PacketId::sample_time_fine), kEveryMessage},
        {wire_id(PacketId::quaternion), rate_hz},
        {wire_id(PacketId::latitude_longitude, NumberFormat::fp16_32), rate_hz},
        {wire_id(PacketId::altitude_ellipsoid, NumberFormat::fp16_32), rate_hz},
        {wire_id(PacketId::velocity), rate_hz},
        {wire_id(PacketId::status_word), kEveryMessage},
        {wire_id(PacketId::gnss_pvt), 4}})
    (void)o.add(e);
  return o;
}

/// The rate of an MTi-G-700/710 next to the one asked for.
std::uint16_t nearest_rate(double rate_hz) noexcept {
  constexpr std::array<std::uint16_t, 15> kRates{1,  2,  4,  5,  8,   10,  16, 20,
                                                 25, 40, 50, 80, 100, 200, 400};
  std::uint16_t best = kRates[0];
  for (const std::uint16_t r : kRates)
    if (std::abs(r - rate_hz) < std::abs(best - rate_hz)) best = r;
  return best;
}

}  // namespace

DeviceStatus Setup::set_mark4(double rate_hz, StreamSettings* stream) {
  const std::uint16_t rate = nearest_rate(rate_hz);
  OutputConfiguration requested = requested_outputs(rate, true);
  if (!line_budget(requested, baud_to_be()).fits()) requested = requested_outputs(rate, false);
  const LineBudget budget = line_budget(requested, baud_to_be());
  if (!budget.fits()) return refuse_load(budget, rate, baud_to_be());

  // Text output, while set, overrides everything else.
  dialogue_.ask(MessageId::string_output, &reply_);
  if (reply_.answer == Answer::ok && reply_.size == 2 && read_u16(reply_.bytes()) != 0) {
    constexpr std::array<std::uint8_t, 2> kOff{0, 0};
    if (const DeviceStatus s = write(MessageId::string_output, kOff, "to leave its text output");
        s != DeviceStatus::ok)
      return s;
  }
  if (const DeviceStatus s =
          write(MessageId::output_configuration, {}, "the question for its outputs");
      s != DeviceStatus::ok)
    return s;
  OutputConfiguration has;
  if (!read_output_configuration(reply_.bytes(), &has) || !(has == requested)) {
    std::array<std::uint8_t, 4 * kMostOutputs> bytes{};
    const std::size_t n = write_output_configuration(requested, bytes);
    if (const DeviceStatus s = write(MessageId::output_configuration, std::span(bytes).first(n),
                                     "the outputs asked for");
        s != DeviceStatus::ok)
      return s;
    if (!read_output_configuration(reply_.bytes(), &has)) has = {};
  }
  // It answers with what it took.
  std::uint16_t taken = 0;
  for (const OutputEntry& e : has.items())
    if (e.id == wire_id(PacketId::quaternion)) taken = e.rate_hz;
  const bool clocked = std::any_of(
      has.items().begin(), has.items().end(),
      [](const OutputEntry& e) { return packet_id(e.id) == PacketId::sample_time_fine; });
  const bool placed = std::any_of(has.items().begin(), has.items().end(), [](const OutputEntry& e) {
    return packet_id(e.id) == PacketId::latitude_longitude;
  });
  if (taken == 0 || taken == kEveryMessage || !clocked || !placed) {
    last_error_ =
        "it does not give position and attitude together with its clock: this is no MTi-G";
    return DeviceStatus::unsupported;
  }
  stream->outputs = has;
  stream->period_numerator = 1;
  stream->period_denominator = taken;
  return set_mark4_lines(stream);
}

DeviceStatus Setup::set_mark4_lines(StreamSettings* stream) {
  if (options_.sync_out_hz == 0 && options_.sync_in == SyncIn::leave) return DeviceStatus::ok;
  if (const DeviceStatus s =
          write(MessageId::sync_settings, {}, "the question for its synchronisation lines");
      s != DeviceStatus::ok)
    return s;
  SyncSettings has;
  if (!read_sync_settings(reply_.bytes(), &has)) {
    last_error_ = "its synchronisation settings cannot be read: this firmware is not known";
    return DeviceStatus::unsupported;
  }
  // The list replaces the old one: other entries, the receiver's clock among them, stay.
  const auto ours = [this](const SyncEntry& e) {
    return (options_.sync_out_hz != 0 && e.function == kSyncIntervalTransition &&
            e.line == kSyncLineOut) ||
           (options_.sync_in != SyncIn::leave && e.function == kSyncTriggerIndication &&
            e.line == kSyncLineIn1);
  };
  SyncSettings requested;
  for (const SyncEntry& e : has.items())
    if (!ours(e)) requested.entries[requested.count++] = e;
  const auto add = [&requested](const SyncEntry& e) {
    if (requested.count == requested.entries.size()) return false;
    requested.entries[requested.count++] = e;
    return true;
  };
  bool room = true;
  if (options_.sync_out_hz > 0) {
    double actual = 0;
    const std::uint16_t skip = sync_out_skip(kSyncOutBase, options_.sync_out_hz, &actual);
    const auto width = static_cast<std::uint16_t>(
        std::clamp(std::lround(options_.sync_out_width_ms * 10), 1L, 1000L));
    room = add({kSyncIntervalTransition, kSyncLineOut, kSyncPositive, 0, 0, skip, width, 0});
    stream->sync_out_hz = actual;
  }
  if (options_.sync_in == SyncIn::rising || options_.sync_in == SyncIn::falling)
    room =
        add({kSyncTriggerIndication, kSyncLineIn1,
             options_.sync_in == SyncIn::rising ? kSyncPositive : kSyncNegative, 0, 0, 0, 0, 0}) &&
        room;
  if (!room) {
    last_error_ = "its list of synchronisation settings is full; clear it with the maker's program";
    return DeviceStatus::unsupported;
  }
  if (requested == has) return DeviceStatus::ok;
  std::array<std::uint8_t, kSyncEntrySize * kMostSyncEntries> bytes{};
  return write(MessageId::sync_settings,
               std::span(bytes).first(write_sync_settings(requested, bytes)),
               "its synchronisation settings");
}

}  // namespace vergence::xsens
