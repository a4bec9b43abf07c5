#include "drivers/xsens/setup.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/common/refused.hpp"
#include "drivers/format_text.hpp"

namespace vergence::xsens {

namespace {

constexpr Duration kRetryInterval = Duration::milliseconds(150);
constexpr Duration kListen = Duration::milliseconds(50);
constexpr Duration kWrite = Duration::milliseconds(100);

}  // namespace

void RequestReply::ask(xbus::MessageId id, std::span<const std::uint8_t> payload, Reply* reply,
                       Duration limit) {
  std::array<std::uint8_t, xbus::kMaxFrame> frame{};
  const xbus::WrittenFrame w =
      xbus::write_frame({xbus::kBusMaster, static_cast<std::uint8_t>(id), payload}, frame);
  const HostStamp end = line_.now() + limit;
  reply->answer = Answer::silent;
  // Ends: each round listens for kRetryInterval within the limit.
  do {
    const DeviceStatus sent = line_.write(std::span(frame).first(w.size), kWrite);
    if (sent == DeviceStatus::disconnected || sent == DeviceStatus::failed) {
      reply->answer = Answer::disconnected;
      return;
    }
    const HostStamp until = std::min(end, line_.now() + kRetryInterval);
    reply->answer = listen(static_cast<std::uint8_t>(static_cast<unsigned>(id) + 1U), until, reply);
  } while (reply->answer == Answer::silent && line_.now() < end);
}

Answer RequestReply::listen(std::uint8_t requested, HostStamp until, Reply* reply) {
  std::array<std::uint8_t, 512> bytes{};
  // Ends at `until`: reading lets time pass.
  for (;;) {
    for (xbus::Message m; stream_.next(&m);) {
      ++messages_;
      if (m.id != requested && !m.is(xbus::MessageId::error)) continue;
      reply->size = m.payload.size();
      std::copy(m.payload.begin(), m.payload.end(), reply->payload.begin());
      if (m.id == requested) return Answer::ok;
      reply->error = m.payload.empty() ? std::uint8_t{0} : m.payload[0];
      // A supply dip is reported without a request; it is no response.
      if (reply->error != xbus::kErrorPowerDip) return Answer::refused;
    }
    if (stop_.load(std::memory_order_acquire)) return Answer::stopped;
    const HostStamp now = line_.now();
    if (now >= until) return Answer::silent;
    const LineRead r = line_.read(bytes, std::min(kListen, until - now));
    if (r.status == DeviceStatus::disconnected || r.status == DeviceStatus::failed ||
        r.status == DeviceStatus::ended)
      return Answer::disconnected;
    if (r.status != DeviceStatus::ok) continue;
    const std::span<const std::uint8_t> got(bytes.data(), r.size);
    remember(got);
    // 512 bytes fit in addition to any incomplete frame.
    (void)stream_.accept(got);
  }
}

void RequestReply::remember(std::span<const std::uint8_t> bytes) noexcept {
  const std::size_t n = std::min(bytes.size(), received_.size() - received_size_);
  std::copy_n(bytes.begin(), n, received_.begin() + static_cast<std::ptrdiff_t>(received_size_));
  received_size_ += n;
}

void RequestReply::reset() noexcept {
  stream_.reset();
  messages_ = 0;
  received_size_ = 0;
}

std::string RequestReply::received_instead() const {
  const std::string_view received(reinterpret_cast<const char*>(received_.data()), received_size_);
  if (received.empty() || messages_ > 0) return {};
  if (received.find("$G") != std::string_view::npos &&
      received.find("\r\n") != std::string_view::npos)
    return "it sends NMEA 0183";
  if (received.find("\xB5\x62") != std::string_view::npos) return "it sends UBX (u-blox)";
  if (received.find("\xAA\x44\x12") != std::string_view::npos) return "it sends NovAtel's protocol";
  if (received.find("snp") != std::string_view::npos)
    return "it sends the protocol of a Redshift or CH Robotics sensor";
  if (received.find("VNYMR") != std::string_view::npos ||
      received.find("$VN") != std::string_view::npos)
    return "it sends VectorNav's protocol";
  return "its bytes are not Xbus";
}

namespace {

using namespace xbus;

// A measuring device sends and a waiting one responds within this time.
constexpr Duration kProbe = Duration::milliseconds(500);
constexpr Duration kAfterReset = Duration::milliseconds(2500);

DeviceStatus to_status(Answer answer) noexcept {
  switch (answer) {
    case Answer::ok:
      return DeviceStatus::ok;
    case Answer::refused:
      return DeviceStatus::failed;
    case Answer::silent:
    case Answer::disconnected:
      return DeviceStatus::disconnected;
    case Answer::stopped:
      return DeviceStatus::stopped;
  }
  return DeviceStatus::failed;
}

}  // namespace

DeviceStatus Setup::probe(std::uint32_t baud, Duration limit) {
  if (line_.baud() != baud) {
    const DeviceStatus status = line_.set_baud(baud);
    if (status != DeviceStatus::ok) return status;
    dialogue_.reset();
  }
  dialogue_.ask(MessageId::go_to_config, {}, &reply_, limit);
  return reply_.answer == Answer::silent ? DeviceStatus::timeout : to_status(reply_.answer);
}

DeviceStatus Setup::find() {
  std::array<std::uint32_t, kBaudScan.size() + 2> bauds{};
  bauds[0] = options_.baud != 0 ? options_.baud : line_.baud();
  bauds[1] = line_.baud();
  std::copy(kBaudScan.begin(), kBaudScan.end(), bauds.begin() + 2);
  std::string instead;
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (std::count(bauds.begin(), bauds.begin() + static_cast<std::ptrdiff_t>(i), bauds[i]) > 0)
      continue;
    const DeviceStatus status = probe(bauds[i], kProbe);
    if (status == DeviceStatus::ok || status == DeviceStatus::stopped) return status;
    if (status == DeviceStatus::disconnected) {
      last_error_ = "the serial link was lost during the search for the device; check its cable";
      return status;
    }
    const std::string received = dialogue_.received_instead();
    // At a wrong rate any device looks like noise, so a recognised protocol takes precedence.
    if (!received.empty() && (instead.empty() || instead == "its bytes are not Xbus"))
      instead = received;
    if (dialogue_.messages_received() > 0)
      instead = format_text(
          "it sends Xbus messages at %u baud, but does not respond; check the wire that transmits "
          "to it",
          bauds[i]);
  }
  last_error_ =
      instead.empty()
          ? "it is silent at every baud rate; check its power, its cable and the port"
          : "no XSens INS responds: " + instead + "; check that ins.port is the port of the INS";
  return DeviceStatus::not_found;
}

void Setup::refuse(DeviceStatus status, std::string message) {
  last_error_ = std::move(message);
  throw Refused{status};
}

void Setup::fail(const char* what, DeviceStatus refused) {
  const bool refused_by_device = reply_.answer == Answer::refused;
  last_error_ = refused_by_device ? format_text("it refuses %s: %.*s (error %02X)", what,
                                                static_cast<int>(error_text(reply_.error).size()),
                                                error_text(reply_.error).data(), reply_.error)
                                  : format_text("it does not respond to %s; check its cable", what);
  throw Refused{refused_by_device ? refused : to_status(reply_.answer)};
}

void Setup::write(MessageId id, std::span<const std::uint8_t> payload, const char* what) {
  dialogue_.ask(id, payload, &reply_);
  if (reply_.answer != Answer::ok) fail(what);
}

DeviceStatus Setup::identify(Identity* identity) {
  return run_steps([&] { *identity = identified(); });
}

Identity Setup::identified() {
  write(MessageId::device_id_request, {}, "the request for its id");
  if (reply_.size < 4)
    refuse(DeviceStatus::unsupported,
           "its identifier has fewer than four bytes, so it is not an XSens INS");
  Identity found;
  found.device_id = read_u32(reply_.bytes());
  dialogue_.ask(MessageId::product_code_request, &reply_);
  if (reply_.answer == Answer::ok) {
    std::size_t n = std::min(reply_.size, sizeof(found.product) - 1);
    while (n > 0 && (reply_.payload[n - 1] == ' ' || reply_.payload[n - 1] == 0)) --n;
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint8_t c = reply_.payload[i];
      found.product[i] = c >= 0x20 && c < 0x7F ? static_cast<char>(c) : '?';
    }
  }
  dialogue_.ask(MessageId::firmware_request, &reply_);
  if (reply_.answer == Answer::ok && reply_.size >= 3)
    std::copy_n(reply_.payload.begin(), 3, std::begin(found.firmware));
  // Decides by capability: only newer devices support an output configuration.
  dialogue_.ask(MessageId::output_configuration, &reply_);
  if (reply_.answer == Answer::ok) {
    found.generation = Generation::mark4;
  } else if (reply_.answer == Answer::refused) {
    found.generation = Generation::legacy;
  } else {
    fail("the request for its outputs");
  }
  return found;
}

void Setup::check_load(const LineBudget& b, double rate_hz) {
  if (b.fits()) return;
  refuse(
      DeviceStatus::no_bandwidth,
      format_text("%.0f Hz need %.0f %% of the serial link at %u baud, and %.0f %% is the limit; ",
                  rate_hz, 100 * b.load, baud_to_be(), 100 * kMaxLineLoad) +
          (b.baud_needed != 0
               ? format_text("set ins.baud to %u, or ins.rate to %.0f or less", b.baud_needed,
                             std::floor(b.greatest_rate))
               : format_text("set ins.rate to %.0f or less", std::floor(b.greatest_rate))));
}

DeviceStatus Setup::set(const Identity& identity, double rate_hz, StreamSettings* stream) {
  StreamSettings requested;
  requested.generation = identity.generation;
  return run_steps([&] {
    if (identity.generation == Generation::legacy)
      set_legacy(rate_hz, &requested);
    else
      set_mark4(rate_hz, &requested);
    set_baud(identity);
    *stream = requested;
  });
}

void Setup::set_baud(const Identity& identity) {
  if (options_.baud == 0 || options_.baud == line_.baud()) return;
  const auto code = baud_code(options_.baud, identity.generation);
  if (!code)
    refuse(
        DeviceStatus::unsupported,
        format_text("it does not support %u baud; set ins.baud to 115200, 230400, 460800 or 921600",
                    options_.baud));
  const std::array<std::uint8_t, 1> payload{*code};
  write(MessageId::baudrate, payload, "the baud rate");
  // Takes effect at the next reset; whether that is still acknowledged is irrelevant.
  dialogue_.ask(MessageId::reset, {}, &reply_, Duration::milliseconds(100));
  const DeviceStatus status = probe(options_.baud, kAfterReset);
  if (status == DeviceStatus::timeout)
    refuse(DeviceStatus::failed, format_text("it does not respond at %u baud after the rate was "
                                             "set; check that the converter supports it",
                                             options_.baud));
  if (status != DeviceStatus::ok) throw Refused{status};
}

DeviceStatus Setup::measure() {
  constexpr std::uint8_t kTooMuch = 0x29;
  return run_steps([&] {
    dialogue_.ask(MessageId::go_to_measurement, &reply_);
    if (reply_.answer == Answer::ok) return;
    fail("the command to measure",
         reply_.error == kTooMuch ? DeviceStatus::no_bandwidth : DeviceStatus::failed);
  });
}

namespace {

using namespace xbus;

// Output configuration of an MTi-G: fixed point 16.32 for the precision of positions; X north, Y
// west, Z up.
constexpr std::uint16_t kLegacyMode =
    kModeOrientation | kModePosition | kModeVelocity | kModeStatus;
constexpr std::uint32_t kLegacySettings =
    settings_format(NumberFormat::fp16_32) | kSettingsQuaternion | kSettingsCounter | kSettingsUtc;

}  // namespace

void Setup::set_legacy(double rate_hz, StreamSettings* stream) {
  const auto period = period_of_rate(rate_hz);
  if (!period)
    refuse(DeviceStatus::unsupported,
           format_text("an MTi-G has no %.6g Hz; its rates divide 115200 Hz (10 to 512, with "
                       "exceptions); set ins.rate to 100 or 120",
                       rate_hz));
  // Includes the receiver's own fix if the link has room for it.
  MtdataLayout layout{static_cast<std::uint16_t>(kLegacyMode | kModeGnss), kLegacySettings};
  if (!line_budget(layout, rate_hz, baud_to_be()).fits()) layout.mode = kLegacyMode;
  if (!line_budget(layout, rate_hz, baud_to_be()).fits()) layout.settings &= ~kSettingsUtc;
  check_load(line_budget(layout, rate_hz, baud_to_be()), rate_hz);

  write(MessageId::configuration_request, {}, "the request for its configuration");
  DeviceConfiguration has;
  if (!read_configuration(reply_.bytes(), &has))
    refuse(DeviceStatus::unsupported,
           "its configuration cannot be read; check that only one device is on the bus");
  std::array<std::uint8_t, 4> bytes{};
  const auto u16 = [&bytes](std::uint16_t v) {
    return write_u16(bytes, v), std::span<const std::uint8_t>(bytes).first(2);
  };
  if (has.period != *period) write(MessageId::period, u16(*period), "the sample period");
  if (has.output_skip != 0) write(MessageId::output_skip, u16(0), "the output skip factor");
  if (has.output_mode != layout.mode)
    write(MessageId::output_mode, u16(layout.mode), "the output mode");
  if (has.output_settings != layout.settings) {
    write_u32(bytes, layout.settings);
    write(MessageId::output_settings, bytes, "the output settings");
  }
  write(MessageId::data_length_request, {}, "the request for its message length");
  if (reply_.size != 2 || read_u16(reply_.bytes()) != layout.payload_size())
    refuse(DeviceStatus::unsupported,
           format_text("its messages have %u bytes, but its settings imply %zu; this firmware is "
                       "not supported",
                       reply_.size == 2 ? unsigned{read_u16(reply_.bytes())} : 0U,
                       layout.payload_size().value_or(0)));
  stream->layout = layout;
  stream->period_numerator = *period;
  stream->period_denominator = kPeriodClock;
  set_legacy_lines(rate_hz, stream);
}

void Setup::set_legacy_line(MessageId id, LegacySync parameter, std::uint32_t value) {
  const std::uint8_t which = static_cast<std::uint8_t>(parameter);
  write(id, {&which, 1}, "the request for a synchronisation line");
  LegacySync stored{};
  std::uint32_t has = 0;
  if (read_legacy_sync(reply_.bytes(), &stored, &has) && stored == parameter && has == value)
    return;
  std::array<std::uint8_t, 5> bytes{};
  write(id, std::span(bytes).first(write_legacy_sync(parameter, value, bytes)),
        "a setting of a synchronisation line");
}

void Setup::set_legacy_lines(double rate_hz, StreamSettings* stream) {
  const auto out = [this](LegacySync p, std::uint32_t v) {
    set_legacy_line(MessageId::legacy_sync_out, p, v);
  };
  if (options_.sync_out_hz < 0) {
    out(LegacySync::mode, kLegacySyncOutOff);
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
      out(parameter, value);
    stream->sync_out_hz = actual;
  }
}

namespace {

using namespace xbus;

/// Output configuration of an MTi-G-700/710. Without UTC it still has the receiver's.
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

/// Nearest supported rate of an MTi-G-700/710.
std::uint16_t nearest_rate(double rate_hz) noexcept {
  constexpr std::array<std::uint16_t, 15> kRates{1,  2,  4,  5,  8,   10,  16, 20,
                                                 25, 40, 50, 80, 100, 200, 400};
  std::uint16_t best = kRates[0];
  for (const std::uint16_t r : kRates)
    if (std::abs(r - rate_hz) < std::abs(best - rate_hz)) best = r;
  return best;
}

}  // namespace

void Setup::set_mark4(double rate_hz, StreamSettings* stream) {
  const std::uint16_t rate = nearest_rate(rate_hz);
  OutputConfiguration requested = requested_outputs(rate, true);
  if (!line_budget(requested, baud_to_be()).fits()) requested = requested_outputs(rate, false);
  check_load(line_budget(requested, baud_to_be()), rate);

  // Text output, if set, overrides everything else.
  dialogue_.ask(MessageId::string_output, &reply_);
  if (reply_.answer == Answer::ok && reply_.size == 2 && read_u16(reply_.bytes()) != 0) {
    constexpr std::array<std::uint8_t, 2> kOff{0, 0};
    write(MessageId::string_output, kOff, "the command to stop its text output");
  }
  write(MessageId::output_configuration, {}, "the request for its outputs");
  OutputConfiguration has;
  if (!read_output_configuration(reply_.bytes(), &has) || !(has == requested)) {
    std::array<std::uint8_t, 4 * kMaxOutputs> bytes{};
    const std::size_t n = write_output_configuration(requested, bytes);
    write(MessageId::output_configuration, std::span(bytes).first(n), "the requested outputs");
    if (!read_output_configuration(reply_.bytes(), &has)) has = {};
  }
  // The response contains the applied values.
  std::uint16_t applied_hz = 0;
  for (const OutputEntry& e : has.items())
    if (e.id == wire_id(PacketId::quaternion)) applied_hz = e.rate_hz;
  const bool clocked = std::any_of(
      has.items().begin(), has.items().end(),
      [](const OutputEntry& e) { return packet_id(e.id) == PacketId::sample_time_fine; });
  const bool placed = std::any_of(has.items().begin(), has.items().end(), [](const OutputEntry& e) {
    return packet_id(e.id) == PacketId::latitude_longitude;
  });
  if (applied_hz == 0 || applied_hz == kEveryMessage || !clocked || !placed)
    refuse(DeviceStatus::unsupported,
           "it does not send position and attitude with its clock, so it is not an MTi-G");
  stream->outputs = has;
  stream->period_numerator = 1;
  stream->period_denominator = applied_hz;
  set_mark4_lines(stream);
}

void Setup::set_mark4_lines(StreamSettings* stream) {
  if (options_.sync_out_hz == 0) return;
  write(MessageId::sync_settings, {}, "the request for its synchronisation lines");
  SyncSettings has;
  if (!read_sync_settings(reply_.bytes(), &has))
    refuse(DeviceStatus::unsupported,
           "its synchronisation settings cannot be read; this firmware is not supported");
  // The list replaces only its own entries; others, such as the receiver's clock, remain.
  SyncSettings requested;
  for (const SyncEntry& e : has.items())
    if (e.function != kSyncIntervalTransition || e.line != kSyncLineOut)
      requested.entries[requested.count++] = e;
  if (options_.sync_out_hz > 0) {
    if (requested.count == requested.entries.size())
      refuse(DeviceStatus::unsupported,
             "its list of synchronisation settings is full; clear it with the maker's program");
    double actual = 0;
    const std::uint16_t skip = sync_out_skip(kSyncOutBase, options_.sync_out_hz, &actual);
    const auto width = static_cast<std::uint16_t>(
        std::clamp(std::lround(options_.sync_out_width_ms * 10), 1L, 1000L));
    requested.entries[requested.count++] = {
        kSyncIntervalTransition, kSyncLineOut, kSyncPositive, 0, 0, skip, width, 0};
    stream->sync_out_hz = actual;
  }
  if (requested == has) return;
  std::array<std::uint8_t, kSyncEntrySize * kMaxSyncEntries> bytes{};
  write(MessageId::sync_settings, std::span(bytes).first(write_sync_settings(requested, bytes)),
        "its synchronisation settings");
}

}  // namespace vergence::xsens
