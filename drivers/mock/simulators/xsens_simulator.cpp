#include "drivers/mock/simulators/xsens_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vergence::mock {
namespace {

using namespace xbus;

constexpr Duration kAnswerTime = Duration::milliseconds(1);
constexpr Duration kWakeTime = Duration::milliseconds(500);  // that a host has to answer a wake-up
constexpr Duration kStartTime = Duration::milliseconds(20);  // from power to the first byte
constexpr std::array<std::uint16_t, 15> kRates{
    1, 2, 4, 5, 8, 10, 16, 20, 25, 40, 50, 80, 100, 200, 400};  // Hz, of an MTi-G-700/710

std::uint8_t id_of(MessageId id) noexcept { return static_cast<std::uint8_t>(id); }

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

std::int32_t rounded(double v) noexcept { return static_cast<std::int32_t>(std::llround(v)); }

}  // namespace

XsensSimulator::XsensSimulator(InsSource source, const XsensSimulatorOptions& options)
    : source_(std::move(source)),
      options_(options),
      random_(options.seed, 710),
      baud_(options.baud),
      stored_baud_(options.baud),
      counter_(options.first_counter),
      outputs_(options.outputs.count > 0 ? options.outputs : factory_outputs()),
      layout_(options.layout),
      period_(options.period) {
  sync_.entries[sync_.count++] = {14, 1, 1, 0, 0, 0, 0, 0};  // the receiver's clock, on by default
  now_ = options.power_on;
  wake(now_);
}

HostStamp XsensSimulator::host_time(std::int64_t ns) const noexcept {
  return options_.power_on + Duration::nanoseconds(std::llround(static_cast<double>(ns) /
                                                                (1 + 1e-6 * options_.clock_ppm)));
}

std::int64_t XsensSimulator::device_ns(HostStamp host) const noexcept {
  return std::llround(static_cast<double>((host - options_.power_on).ns()) *
                      (1 + 1e-6 * options_.clock_ppm));
}

std::int64_t XsensSimulator::period_ns() const noexcept {
  if (legacy())
    return static_cast<std::int64_t>(period_) * (skip_ + 1) * 1'000'000'000 / kPeriodClock;
  std::uint16_t rate = 0;
  for (const OutputEntry& e : outputs_.items())
    if (e.rate_hz != kEveryMessage && (e.id & 0xF000U) != 0x7000U) rate = std::max(rate, e.rate_hz);
  return rate == 0 ? 1'000'000'000 : 1'000'000'000 / rate;
}

double XsensSimulator::rate_hz() const noexcept { return 1e9 / static_cast<double>(period_ns()); }

// ---- states

void XsensSimulator::wake(HostStamp at) {
  baud_ = stored_baud_;
  in_.reset();
  outgoing_.clear();
  mode_ = Mode::waking;
  send(at + kStartTime, id_of(MessageId::wake_up), {});
  waits_for_host_until_ = at + kStartTime + kWakeTime;
}

void XsensSimulator::measure(HostStamp at) {
  mode_ = Mode::measuring;
  sample_ns_ = (device_ns(at) / period_ns() + 2) * period_ns();  // on the device's own grid
  plan_sample();
  next_fix_ns_ = sample_ns_;
}

void XsensSimulator::power_cycle(HostStamp at) {
  now_ = std::max(now_, at);
  clock_zero_ns_ = device_ns(now_);
  counter_ = 0;
  options_.first_sample_time = 0;
  wake(now_);
}

bool XsensSimulator::ended() const {
  return now_ > options_.power_on + options_.duration && outgoing_.empty();
}

// ---- what the host says

void XsensSimulator::receive(std::span<const std::uint8_t> bytes, HostStamp at) {
  now_ = std::max(now_, at);
  while (!bytes.empty()) {
    bytes = bytes.subspan(in_.accept(bytes));
    for (Message m; in_.next(&m);) handle(m);
  }
}

void XsensSimulator::answer(std::uint8_t id, std::span<const std::uint8_t> payload) {
  send(now_ + kAnswerTime, id, payload);
}

void XsensSimulator::refuse(std::uint8_t code) {
  ++writes_.refused;
  answer(id_of(MessageId::error), std::array{code});
}

void XsensSimulator::send(HostStamp at, std::uint8_t id, std::span<const std::uint8_t> payload) {
  std::array<std::uint8_t, kMaxFrame> frame{};
  const WrittenFrame w = write_frame({kBusMaster, id, payload}, frame);
  Outgoing o{at, {frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(w.size)}};
  // In order of their times, the earlier said first among equals.
  const auto place = std::upper_bound(outgoing_.begin(), outgoing_.end(), at,
                                      [](HostStamp t, const Outgoing& e) { return t < e.at; });
  outgoing_.insert(place, std::move(o));
}

void XsensSimulator::handle(const Message& m) {
  if (m.is(MessageId::go_to_config)) {
    mode_ = Mode::configuring;
    answer(m.id + 1, {});
    return;
  }
  if (m.is(MessageId::wake_up_answer) && mode_ == Mode::waking) {
    mode_ = Mode::configuring;
    return;
  }
  if (m.is(MessageId::reset)) {
    answer(m.id + 1, {});
    reset_at_ = now_ + kAnswerTime * 5;  // the answer still goes out at the old baud rate
    return;
  }
  if (mode_ == Mode::configuring) handle_setting(m);
}

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

// ---- what it measures

std::optional<HostStamp> XsensSimulator::next() const {
  std::optional<HostStamp> first;
  const auto consider = [&first](HostStamp t) {
    if (!first || t < *first) first = t;
  };
  if (!outgoing_.empty()) consider(outgoing_.front().at);
  if (reset_at_) consider(*reset_at_);
  if (mode_ == Mode::waking) consider(waits_for_host_until_);
  if (mode_ == Mode::measuring && sample_at_ <= options_.power_on + options_.duration)
    consider(sample_at_);
  if (dips_done_ < options_.dips.size()) consider(options_.dips[dips_done_]);
  if (silences_done_ < options_.silences.size()) consider(options_.silences[silences_done_]);
  if (!first && now_ <= options_.power_on + options_.duration)
    consider(options_.power_on + options_.duration + Duration::nanoseconds(1));
  return first;
}

void XsensSimulator::produce(HostStamp at, std::vector<std::uint8_t>* out) {
  now_ = std::max(now_, at);
  if (dips_done_ < options_.dips.size() && now_ >= options_.dips[dips_done_]) {
    ++dips_done_;
    power_cycle(now_);
    send(now_ + kStartTime + kAnswerTime, id_of(MessageId::error), std::array{kErrorPowerDip});
  }
  if (reset_at_ && now_ >= *reset_at_) {
    reset_at_.reset();
    power_cycle(now_);
  }
  if (silences_done_ < options_.silences.size() && now_ >= options_.silences[silences_done_]) {
    ++silences_done_;
    mode_ = Mode::mute;
    outgoing_.clear();
  }
  if (mode_ == Mode::waking && now_ >= waits_for_host_until_) {
    if (legacy()) send_configuration(now_);
    measure(now_);
  }
  if (mode_ == Mode::measuring && now_ >= sample_at_) take_sample();
  while (!outgoing_.empty() && outgoing_.front().at <= now_) {
    out->insert(out->end(), outgoing_.front().bytes.begin(), outgoing_.front().bytes.end());
    outgoing_.pop_front();
  }
}

void XsensSimulator::plan_sample() { sample_at_ = host_time(sample_ns_); }

void XsensSimulator::take_sample() {
  Taken taken;
  taken.device_ns = sample_ns_;
  taken.sample = source_(samples_++, sample_at_ - options_.power_on);
  sample_times_.push_back(sample_ns_);
  if (sample_times_.size() > kRemembered) sample_times_.pop_front();
  const HostStamp ready =
      sample_at_ + options_.processing +
      Duration::nanoseconds(
          std::llround(random_.uniform() * static_cast<double>(options_.processing_jitter.ns())));
  if (legacy())
    send_legacy(taken, ready);
  else
    send_mark4(taken, ready);
  history_.push_back(taken);
  if (history_.size() > static_cast<std::size_t>(options_.fix_age) + 1) history_.pop_front();
  if (!legacy() && sample_ns_ >= next_fix_ns_) {
    next_fix_ns_ += options_.fix_interval.ns();
    send_fix(ready);
  }
  sample_ns_ += period_ns();
  plan_sample();
}

namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

/// v_local = M v_enu, row by row: written out so that the driver's way through quaternions is
/// checked against another.
Matrix local_from_enu(LocalFrame frame) noexcept {
  switch (frame) {
    case LocalFrame::ned:
      return {{{0, 1, 0}, {1, 0, 0}, {0, 0, -1}}};
    case LocalFrame::nwu:
      return {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}};
    case LocalFrame::enu:
      break;
  }
  return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

/// Rotation matrix sensor → local frame.
Matrix attitude_in(LocalFrame frame, const InsSample& s) noexcept {
  const double x = s.q_enu_ins[0], y = s.q_enu_ins[1], z = s.q_enu_ins[2], w = s.q_enu_ins[3];
  const Matrix R{{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                  {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                  {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
  const Matrix M = local_from_enu(frame);
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) out[i][j] += M[i][k] * R[k][j];
  return out;
}

Three in_frame(LocalFrame frame, const std::array<double, 3>& v) noexcept {
  const Matrix M = local_from_enu(frame);
  Three out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) out[i] += M[i][k] * v[k];
  return out;
}

/// w x y z of a rotation matrix, by its largest component.
std::array<double, 4> quaternion_of(const Matrix& R) noexcept {
  const double t = R[0][0] + R[1][1] + R[2][2];
  if (t > 0) {
    const double s = 2 * std::sqrt(t + 1);
    return {s / 4, (R[2][1] - R[1][2]) / s, (R[0][2] - R[2][0]) / s, (R[1][0] - R[0][1]) / s};
  }
  std::size_t i = R[1][1] > R[0][0] ? 1 : 0;
  if (R[2][2] > R[i][i]) i = 2;
  const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
  const double s = 2 * std::sqrt(1 + R[i][i] - R[j][j] - R[k][k]);
  std::array<double, 4> q{};
  q[0] = (R[k][j] - R[j][k]) / s;
  q[i + 1] = s / 4;
  q[j + 1] = (R[j][i] + R[i][j]) / s;
  q[k + 1] = (R[k][i] + R[i][k]) / s;
  return q;
}

Three euler_deg_of(const Matrix& R) noexcept {
  constexpr double kDegree = 180 / 3.14159265358979323846;
  return {kDegree * std::atan2(R[2][1], R[2][2]),
          -kDegree * std::asin(std::clamp(R[2][0], -1.0, 1.0)),
          kDegree * std::atan2(R[1][0], R[0][0])};
}

std::array<double, 9> flat(const Matrix& R) noexcept {
  return {R[0][0], R[0][1], R[0][2], R[1][0], R[1][1], R[1][2], R[2][0], R[2][1], R[2][2]};
}

Three gravity_in_body(const InsSample& s) noexcept {
  constexpr double kGravity = 9.79;
  const Matrix R = attitude_in(LocalFrame::enu, s);
  return {kGravity * R[2][0], kGravity * R[2][1], kGravity * R[2][2]};
}

std::uint32_t status_of(const InsSample& s) noexcept {
  const bool fix = s.fix == FixStatus::fix_2d || s.fix == FixStatus::fix_3d;
  std::uint32_t status = kStatusSelfTest | kStatusClockSynced;
  if (s.attitude_valid) status |= kStatusFilterValid;
  if (fix) status |= kStatusGnssFix | (3U << 23U);
  if (s.fix == FixStatus::dead_reckoning) status |= 1U << 23U;
  return status;
}

}  // namespace

void XsensSimulator::send_legacy(const Taken& now, HostStamp at) {
  Mtdata d;
  const LocalFrame frame = layout_.frame();
  const InsSample& s = now.sample;
  const Matrix R = attitude_in(frame, s);
  d.raw = RawInertial{};
  d.temperature_c = 31.5;
  d.acceleration = gravity_in_body(s);
  d.quaternion = quaternion_of(R);
  d.euler_deg = euler_deg_of(R);
  d.rotation_matrix = flat(R);
  d.latitude_longitude_deg = std::array{s.position.latitude_deg, s.position.longitude_deg};
  d.altitude_m = s.position.height_m;
  d.velocity = in_frame(frame, s.velocity_enu);
  d.status = static_cast<std::uint8_t>(status_of(s) & 0x7U);
  d.sample_counter = counter_++;
  d.utc = utc_of_unix_ns(options_.unix_ns_at_power_on + now.device_ns, 7);
  fix_age_ = sample_ns_ >= next_fix_ns_ ? std::uint8_t{0}
                                        : static_cast<std::uint8_t>(std::min(255, fix_age_ + 1));
  if (sample_ns_ >= next_fix_ns_) next_fix_ns_ += options_.fix_interval.ns();
  LegacyFix f;
  constexpr double kSeaLevel = 101325;
  f.pressure_2pa = static_cast<std::uint16_t>(kSeaLevel / 2);
  f.itow_ms = static_cast<std::uint32_t>(now.device_ns / 1'000'000);
  const InsSample& then = history_.empty() ? s : history_.front().sample;
  f.latitude_1e7_deg = rounded(then.position.latitude_deg * 1e7);
  f.longitude_1e7_deg = rounded(then.position.longitude_deg * 1e7);
  f.height_mm = rounded(then.position.height_m * 1e3);
  f.velocity_north_cm_s = rounded(then.velocity_enu[1] * 1e2);
  f.velocity_east_cm_s = rounded(then.velocity_enu[0] * 1e2);
  f.velocity_down_cm_s = rounded(-then.velocity_enu[2] * 1e2);
  f.horizontal_accuracy_mm =
      static_cast<std::uint32_t>(rounded(then.position_sigma * std::sqrt(2.0) * 1e3));
  f.vertical_accuracy_mm = static_cast<std::uint32_t>(rounded(then.height_sigma * 1e3));
  f.speed_accuracy_cm_s = static_cast<std::uint32_t>(rounded(then.velocity_sigma * 1e2));
  f.age = fix_age_;
  d.fix = f;
  std::array<std::uint8_t, kMaxPayload> payload{};
  send(at, id_of(MessageId::mtdata), std::span(payload).first(encode_mtdata(d, layout_, payload)));
}

void XsensSimulator::put_stamps(std::int64_t sample_ns, PacketWriter* packets) {
  const auto ticks = static_cast<std::uint64_t>((sample_ns - clock_zero_ns_) / 100'000) +
                     options_.first_sample_time;
  for (const OutputEntry& e : outputs_.items()) {
    if (e.rate_hz != kEveryMessage) continue;
    switch (packet_id(e.id)) {
      case PacketId::utc:
        packets->put_utc(utc_of_unix_ns(options_.unix_ns_at_power_on + sample_ns, 7));
        break;
      case PacketId::packet_counter:
        packets->put_u16(e.id, counter_);
        break;
      case PacketId::sample_time_fine:
        packets->put_u32(e.id, static_cast<std::uint32_t>(ticks % options_.sample_time_modulus));
        break;
      default:
        break;
    }
  }
  ++counter_;
}

void XsensSimulator::send_mark4(const Taken& now, HostStamp at) {
  std::array<std::uint8_t, kMaxPayload> buffer{};
  PacketWriter packets(buffer);
  const InsSample& s = now.sample;
  put_stamps(now.device_ns, &packets);
  const bool place = s.fix != FixStatus::none && !(options_.missing_position > 0 &&
                                                   random_.uniform() < options_.missing_position);
  for (const OutputEntry& e : outputs_.items()) {
    const auto frame = static_cast<LocalFrame>((e.id >> 2U) & 3U);
    switch (packet_id(e.id)) {
      case PacketId::quaternion:
        packets.put_numbers(e.id, quaternion_of(attitude_in(frame, s)));
        break;
      case PacketId::euler:
        packets.put_numbers(e.id, euler_deg_of(attitude_in(frame, s)));
        break;
      case PacketId::rotation_matrix:
        packets.put_numbers(e.id, flat(attitude_in(frame, s)));
        break;
      case PacketId::acceleration:
        packets.put_numbers(e.id, gravity_in_body(s));
        break;
      case PacketId::rate_of_turn:
        packets.put_numbers(e.id, Three{});
        break;
      case PacketId::latitude_longitude:
        if (place)
          packets.put_numbers(e.id, std::array{s.position.latitude_deg, s.position.longitude_deg});
        break;
      case PacketId::altitude_ellipsoid:
        if (place) packets.put_numbers(e.id, std::array{s.position.height_m});
        break;
      case PacketId::velocity:
        if (place) packets.put_numbers(e.id, in_frame(frame, s.velocity_enu));
        break;
      case PacketId::status_word:
        packets.put_u32(e.id, status_of(s) | (sync_out_within(sample_ns_ - period_ns(), sample_ns_)
                                                  ? kStatusSyncOutMarker
                                                  : 0U));
        break;
      case PacketId::status_byte:
        packets.put(e.id, std::array{static_cast<std::uint8_t>(status_of(s))});
        break;
      default:
        break;
    }
  }
  send(at, id_of(MessageId::mtdata2), packets.payload());
}

void XsensSimulator::send_fix(HostStamp at) {
  bool requested = false;
  for (const OutputEntry& e : outputs_.items())
    requested = requested || packet_id(e.id) == PacketId::gnss_pvt;
  if (!requested) return;
  const Taken& then = history_.front();
  const InsSample& s = then.sample;
  const Utc utc = utc_of_unix_ns(options_.unix_ns_at_power_on + then.device_ns, 7);
  GnssPvt p;
  p.itow_ms = static_cast<std::uint32_t>(then.device_ns / 1'000'000);
  p.year = utc.year, p.month = utc.month, p.day = utc.day, p.hour = utc.hour, p.minute = utc.minute,
  p.second = utc.second;
  p.nanosecond = static_cast<std::int32_t>(utc.nanosecond);
  p.valid = 0x37;  // bits beyond the documented ones are set, too
  p.fix = s.fix == FixStatus::fix_3d ? 3 : s.fix == FixStatus::fix_2d ? 2 : 0;
  p.flags = p.fix > 1 ? 1 : 0;
  p.satellites = p.fix > 1 ? 11 : 0;
  p.longitude_1e7_deg = rounded(s.position.longitude_deg * 1e7);
  p.latitude_1e7_deg = rounded(s.position.latitude_deg * 1e7);
  p.height_ellipsoid_mm = rounded(s.position.height_m * 1e3);
  p.height_msl_mm = p.height_ellipsoid_mm - 38'000;
  const auto accuracy = [&p](double sigma) {
    return p.fix > 1 ? static_cast<std::uint32_t>(rounded(sigma * 1e3)) : 0xFFFFFFFFU;
  };
  p.horizontal_accuracy_mm = accuracy(s.position_sigma * std::sqrt(2.0));
  p.vertical_accuracy_mm = accuracy(s.height_sigma);
  p.speed_accuracy_mm_s = accuracy(s.velocity_sigma);
  p.velocity_east_mm_s = rounded(s.velocity_enu[0] * 1e3);
  p.velocity_north_mm_s = rounded(s.velocity_enu[1] * 1e3);
  p.velocity_down_mm_s = rounded(-s.velocity_enu[2] * 1e3);
  std::array<std::uint8_t, kMaxPayload> buffer{};
  PacketWriter packets(buffer);
  packets.put_pvt(p);  // in these messages the data stands before the stamps
  put_stamps(then.device_ns, &packets);
  send(at, id_of(MessageId::mtdata2), packets.payload());
}

bool XsensSimulator::sync_out_within(std::int64_t from_ns, std::int64_t to_ns) const noexcept {
  for (const SyncEntry& e : sync_.items()) {
    if (e.function != kSyncIntervalTransition || e.line != kSyncLineOut || e.polarity == 0)
      continue;
    const auto period = static_cast<std::int64_t>(1e9 / kSyncOutBase) * (e.skip + 1);
    if (to_ns / period != from_ns / period) return true;
  }
  return false;
}

}  // namespace vergence::mock
