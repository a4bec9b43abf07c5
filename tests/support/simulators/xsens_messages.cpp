#include "tests/support/simulators/xsens_messages.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/types.hpp"

namespace vergence::test {
namespace {

using namespace xbus;

std::int32_t rounded(double v) noexcept { return static_cast<std::int32_t>(std::llround(v)); }

/// v_local = M v_enu: by rotation matrices, so that the driver's way through quaternions is checked
/// against another.
Mat3 local_from_enu(LocalFrame frame) noexcept {
  Mat3 M = Mat3::Identity();
  if (frame == LocalFrame::ned) M << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  if (frame == LocalFrame::nwu) M << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  return M;
}

/// Rotation sensor → local frame, w x y z.
std::array<double, 4> attitude_in(LocalFrame frame, const InsSample& s) noexcept {
  const auto& p = s.q_enu_ins;
  const Mat3 R = Eigen::Quaterniond(p[3], p[0], p[1], p[2]).toRotationMatrix();
  const Eigen::Quaterniond q(local_from_enu(frame) * R);
  return {q.w(), q.x(), q.y(), q.z()};
}

Three in_frame(LocalFrame frame, const std::array<double, 3>& v) noexcept {
  const Vec3 local = local_from_enu(frame) * Vec3(v[0], v[1], v[2]);
  return {local.x(), local.y(), local.z()};
}

std::uint32_t status_of(const InsSample& s) noexcept {
  const bool fix = s.fix == FixStatus::fix_2d || s.fix == FixStatus::fix_3d;
  std::uint32_t status = kStatusSelfTest | kStatusClockSynced;
  if (s.attitude_valid) status |= kStatusFilterValid;
  if (fix) status |= kStatusGnssFix | (3U << 23U);
  if (s.fix == FixStatus::dead_reckoning) status |= 1U << 23U;
  return status;
}

[[nodiscard]] std::uint8_t id_of(MessageId id) noexcept { return static_cast<std::uint8_t>(id); }

[[nodiscard]] XsensMessages::Message message(MessageId id, std::span<const std::uint8_t> payload) {
  return {id_of(id), {payload.begin(), payload.end()}};
}

}  // namespace

XsensMessages::XsensMessages(const XsensSimulatorOptions& options, const XsensSettings& settings)
    : options_(options),
      settings_(settings),
      first_sample_time_(options.first_sample_time),
      counter_(options.first_counter) {}

void XsensMessages::power_cycle(std::int64_t device_ns) noexcept {
  clock_zero_ns_ = device_ns;
  counter_ = 0;
  first_sample_time_ = 0;
}

void XsensMessages::add(const Sample& now, Random* random, std::vector<Message>* out) {
  out->push_back(settings_.legacy() ? legacy(now) : mark4(now, random));
  history_.push_back(now);
  if (history_.size() > static_cast<std::size_t>(options_.fix_age) + 1) history_.pop_front();
  if (settings_.legacy() || now.device_ns < next_fix_ns_) return;
  next_fix_ns_ += options_.fix_interval.ns();
  if (fix_requested()) out->push_back(fix());
}

XsensMessages::Message XsensMessages::legacy(const Sample& now) {
  Mtdata d;
  const LocalFrame frame = settings_.layout().frame();
  const InsSample& s = now.sample;
  d.quaternion = attitude_in(frame, s);
  d.latitude_longitude_deg = std::array{s.position.latitude_deg, s.position.longitude_deg};
  d.altitude_m = s.position.height_m;
  d.velocity = in_frame(frame, s.velocity_enu);
  d.status = static_cast<std::uint8_t>(status_of(s) & 0x7U);
  d.sample_counter = counter_++;
  d.utc = utc_of_unix_ns(options_.unix_ns_at_power_on + now.device_ns, 7);
  fix_age_ = now.device_ns >= next_fix_ns_ ? std::uint8_t{0}
                                           : static_cast<std::uint8_t>(std::min(255, fix_age_ + 1));
  if (now.device_ns >= next_fix_ns_) next_fix_ns_ += options_.fix_interval.ns();
  LegacyFix f;
  const InsSample& then = history_.empty() ? s : history_.front().sample;
  f.horizontal_accuracy_mm =
      static_cast<std::uint32_t>(rounded(then.position_sigma * std::sqrt(2.0) * 1e3));
  f.vertical_accuracy_mm = static_cast<std::uint32_t>(rounded(then.height_sigma * 1e3));
  f.speed_accuracy_cm_s = static_cast<std::uint32_t>(rounded(then.velocity_sigma * 1e2));
  f.age = fix_age_;
  d.fix = f;
  std::array<std::uint8_t, kMaxPayload> payload{};
  return message(MessageId::mtdata,
                 std::span(payload).first(encode_mtdata(d, settings_.layout(), payload)));
}

void XsensMessages::put_stamps(std::int64_t sample_ns, PacketWriter* packets) {
  const auto ticks =
      static_cast<std::uint64_t>((sample_ns - clock_zero_ns_) / 100'000) + first_sample_time_;
  for (const OutputEntry& e : settings_.outputs().items()) {
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

XsensMessages::Message XsensMessages::mark4(const Sample& now, Random* random) {
  std::array<std::uint8_t, kMaxPayload> buffer{};
  PacketWriter packets(buffer);
  const InsSample& s = now.sample;
  put_stamps(now.device_ns, &packets);
  const bool place = s.fix != FixStatus::none && !(options_.missing_position > 0 &&
                                                   random->uniform() < options_.missing_position);
  for (const OutputEntry& e : settings_.outputs().items()) {
    const auto frame = static_cast<LocalFrame>((e.id >> 2U) & 3U);
    switch (packet_id(e.id)) {
      case PacketId::quaternion:
        packets.put_numbers(e.id, attitude_in(frame, s));
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
        packets.put_u32(
            e.id, status_of(s) | (settings_.sync_out_within(now.device_ns - settings_.period_ns(),
                                                            now.device_ns)
                                      ? kStatusSyncOutMarker
                                      : 0U));
        break;
      default:
        break;
    }
  }
  return message(MessageId::mtdata2, packets.payload());
}

bool XsensMessages::fix_requested() const noexcept {
  bool requested = false;
  for (const OutputEntry& e : settings_.outputs().items())
    requested = requested || packet_id(e.id) == PacketId::gnss_pvt;
  return requested;
}

/// Number of the oldest stored sample.
XsensMessages::Message XsensMessages::fix() {
  const Sample& then = history_.front();
  const InsSample& s = then.sample;
  GnssPvt p{.fix = std::uint8_t(s.fix == FixStatus::fix_3d   ? 3
                                : s.fix == FixStatus::fix_2d ? 2
                                                             : 0)};
  p.flags = p.fix > 1 ? 1 : 0;
  p.satellites = p.fix > 1 ? 11 : 0;
  const auto accuracy = [&p](double sigma) {
    return p.fix > 1 ? static_cast<std::uint32_t>(rounded(sigma * 1e3)) : 0xFFFFFFFFU;
  };
  p.horizontal_accuracy_mm = accuracy(s.position_sigma * std::sqrt(2.0));
  p.vertical_accuracy_mm = accuracy(s.height_sigma);
  p.speed_accuracy_mm_s = accuracy(s.velocity_sigma);
  std::array<std::uint8_t, kMaxPayload> buffer{};
  PacketWriter packets(buffer);
  // In these messages the data stands before the stamps.
  packets.put_pvt(p);
  put_stamps(then.device_ns, &packets);
  return message(MessageId::mtdata2, packets.payload());
}

}  // namespace vergence::test
