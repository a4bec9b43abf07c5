#include "drivers/xsens/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "core/math/angle.hpp"

namespace vergence::xsens {

namespace {

ClockMapperOptions mapper_options() noexcept {
  ClockMapperOptions o;
  // Delay of a read after its last byte: a USB frame and the scheduler.
  o.delay_spread = Duration::milliseconds(5);
  // Tick of SampleTimeFine.
  o.resolution = Duration::microseconds(100);
  o.jump = Duration::milliseconds(20);
  o.stall = Duration::seconds(1);
  return o;
}

}  // namespace

ArrivalTiming::ArrivalTiming(std::uint32_t baud, Duration processing) noexcept
    : mapper_(mapper_options()), processing_(processing), byte_ns_(1e10 / std::max(1U, baud)) {}

void ArrivalTiming::restart() noexcept {
  mapper_.restart();
  count_ = 0;
  known_ = false;
  line_known_ = false;
}

Duration ArrivalTiming::wire_time(std::uint64_t bytes) const noexcept {
  return Duration::nanoseconds(std::llround(static_cast<double>(bytes) * byte_ns_));
}

void ArrivalTiming::read(std::uint64_t end, HostStamp arrival) noexcept {
  if (count_ == marks_.size()) {
    std::move(marks_.begin() + 1, marks_.end(), marks_.begin());
    --count_;
  }
  marks_[count_++] = {end, arrival};
}

void ArrivalTiming::drop_marks(std::uint64_t end) noexcept {
  std::size_t n = 0;
  while (n < count_ && marks_[n].end <= end) ++n;
  std::move(marks_.begin() + static_cast<std::ptrdiff_t>(n),
            marks_.begin() + static_cast<std::ptrdiff_t>(count_), marks_.begin());
  count_ -= n;
}

void ArrivalTiming::other(std::uint64_t end) noexcept {
  if (end <= end_) return;
  line_free_ = line_free_ + wire_time(end - end_);
  end_ = end;
  drop_marks(end);
}

void ArrivalTiming::message(std::uint64_t begin, std::uint64_t end, DeviceStamp measured) noexcept {
  other(begin);
  DeviceStamp sent = measured + processing_;
  if (line_known_) sent = std::max(sent, line_free_);
  for (std::size_t i = 0; i < count_ && marks_[i].end <= end; ++i) {
    witness_ = sent + wire_time(marks_[i].end - begin);
    mapped_ = mapper_.map(witness_, marks_[i].arrival);
    known_ = true;
  }
  line_free_ = sent + wire_time(end - begin);
  line_known_ = true;
  end_ = end;
  drop_marks(end);
}

MappedStamp ArrivalTiming::at(DeviceStamp measured) const noexcept {
  const Duration since = measured - witness_;
  const double stretch = static_cast<double>(since.ns()) * mapper_.drift();
  return {mapped_.host + since + Duration::nanoseconds(std::llround(stretch)), mapped_.error};
}

std::int64_t SampleTime::difference(std::uint32_t ticks) const noexcept {
  const std::int64_t plain = static_cast<std::int64_t>(ticks) - static_cast<std::int64_t>(last_);
  // Takes the nearest of three: no wrap, a day's, or the full width's. A counter beyond a day's end
  // has the full width.
  std::int64_t best = plain;
  for (const std::int64_t modulus : {kDay, kFull}) {
    if (modulus == kDay && (last_ >= kDay || ticks >= kDay)) continue;
    for (const std::int64_t d : {plain + modulus, plain - modulus})
      if (std::llabs(d) < std::llabs(best)) best = d;
  }
  return best;
}

ClockStep SampleTime::next(std::uint32_t ticks, Duration elapsed) noexcept {
  if (!known_) {
    known_ = true;
    last_ = ticks;
    ticks_ = ticks;
    return ClockStep::first;
  }
  const std::int64_t d = difference(ticks);
  if (d > kFarthest || d < -kFarthest) {
    // Keeps increasing, for users of differences.
    ticks_ += std::max<std::int64_t>(1, elapsed.ns() / kTick);
    last_ = ticks;
    return ClockStep::restart;
  }
  if (d <= 0) return ClockStep::backward;
  ticks_ += d;
  last_ = ticks;
  return ClockStep::forward;
}

std::optional<DeviceStamp> SampleTime::near(std::uint32_t ticks) const noexcept {
  if (!known_) return std::nullopt;
  const std::int64_t d = difference(ticks);
  if (d > kFarthest || d < -kFarthest) return std::nullopt;
  return DeviceStamp((ticks_ + d) * kTick);
}

ClockStep SampleCounter::next(std::uint16_t counter, std::int64_t expected_steps) noexcept {
  if (!known_) {
    known_ = true;
    last_ = counter;
    count_ = counter;
    return ClockStep::first;
  }
  const auto d = static_cast<std::uint16_t>(counter - last_);
  last_ = counter;
  // Takes the step allowed by the 16 bits that is nearest to the elapsed time.
  constexpr std::int64_t kWrap = 65536, kTolerance = 2048;
  const std::int64_t wraps = (expected_steps - d + kWrap / 2) / kWrap;
  const std::int64_t steps = d + std::max<std::int64_t>(0, wraps) * kWrap;
  if (steps == 0) return ClockStep::backward;
  if (std::llabs(steps - expected_steps) > kTolerance) {
    count_ += std::max<std::int64_t>(1, expected_steps);
    return ClockStep::restart;
  }
  count_ += steps;
  return ClockStep::forward;
}

namespace {

using namespace xbus;

Eigen::Quaterniond enu_from(LocalFrame frame) noexcept {
  const double h = std::numbers::sqrt2 / 2;
  switch (frame) {
    case LocalFrame::nwu:
      return {h, 0, 0, h};
    case LocalFrame::ned:
      return {0, h, h, 0};
    case LocalFrame::enu:
      break;
  }
  return Eigen::Quaterniond::Identity();
}

/// Status bits common to both generations.
void fill_fix(bool filter_valid, bool fix, bool coasting, const Receiver& receiver, HostStamp now,
              InsReading* r) noexcept {
  const bool fresh = receiver.known && now - receiver.received < kReceiverStale;
  InsSample& s = r->sample;
  r->quality.filter_valid = filter_valid;
  if (fresh) {
    r->quality.satellites = receiver.satellites;
    r->quality.position_dop = receiver.position_dop;
  }
  if (!filter_valid) {
    s.fix = FixStatus::none;
    s.attitude_valid = false;
    return;
  }
  if (fix) {
    constexpr std::uint8_t kTwoDimensional = 2;
    s.fix = fresh && receiver.fix == kTwoDimensional ? FixStatus::fix_2d : FixStatus::fix_3d;
    if (fresh) {
      s.position_sigma = receiver.position_sigma;
      s.height_sigma = receiver.height_sigma;
      s.velocity_sigma = receiver.velocity_sigma;
    }
  } else {
    s.fix = coasting ? FixStatus::dead_reckoning : FixStatus::none;
  }
}

void place(const std::optional<std::array<double, 2>>& latitude_longitude,
           const std::optional<double>& altitude, InsSample* s) noexcept {
  Geodetic at;
  if (latitude_longitude && altitude)
    at = {(*latitude_longitude)[0], (*latitude_longitude)[1], *altitude};
  if (latitude_longitude && altitude && at.plausible()) {
    s->position = at;
    return;
  }
  s->fix = FixStatus::none;
  s->position_sigma = s->height_sigma = 0;
}

template <class Data>
void fill_motion(const Data& d, LocalFrame orientation_frame, LocalFrame velocity_frame,
                 InsSample* s) noexcept {
  if (d.quaternion) {
    if (const auto enu = enu_attitude(*d.quaternion, orientation_frame)) {
      s->q_enu_ins = *enu;
      s->attitude_valid = true;
    }
  }
  if (d.velocity) {
    s->velocity_enu = enu_vector(*d.velocity, velocity_frame);
    s->velocity_valid = true;
  }
}

void fill_utc(const std::optional<Utc>& utc, std::uint8_t enough, InsQuality* quality) noexcept {
  if (!utc || !plausible(*utc)) return;
  quality->utc_ns = unix_ns(*utc);
  quality->utc_valid = (utc->flags & enough) != 0;
}

}  // namespace

std::optional<std::array<double, 4>> enu_attitude(const std::array<double, 4>& wxyz,
                                                  LocalFrame frame) noexcept {
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  const double n = q.norm();
  // Wide enough for rounding in format 12.20.
  constexpr double kMin = 0.9, kMax = 1.1;
  if (!(n > kMin && n < kMax)) return std::nullopt;
  const Eigen::Quaterniond enu = enu_from(frame) * Eigen::Quaterniond(q.coeffs() / n);
  return std::array{enu.x(), enu.y(), enu.z(), enu.w()};
}

std::array<double, 3> enu_vector(const Three& v, LocalFrame frame) noexcept {
  switch (frame) {
    case LocalFrame::nwu:
      return {-v[1], v[0], v[2]};
    case LocalFrame::ned:
      return {v[1], v[0], -v[2]};
    case LocalFrame::enu:
      break;
  }
  return v;
}

Receiver to_receiver(const GnssPvt& p, HostStamp received) noexcept {
  constexpr std::uint32_t kUnknown = 0xFFFFFFFF;
  constexpr std::uint16_t kNoDop = 9999;
  const auto metres = [](std::uint32_t mm) { return mm == kUnknown ? 0 : 1e-3 * mm; };
  Receiver r;
  r.known = true;
  r.received = received;
  r.fix = (p.flags & 1U) != 0 ? p.fix : std::uint8_t{0};
  r.satellites = p.satellites;
  if (p.position_dop_1e2 != kNoDop) r.position_dop = 0.01F * static_cast<float>(p.position_dop_1e2);
  // The receiver's horizontal accuracy combines both axes.
  r.position_sigma = metres(p.horizontal_accuracy_mm) / std::numbers::sqrt2;
  r.height_sigma = metres(p.vertical_accuracy_mm);
  r.velocity_sigma = metres(p.speed_accuracy_mm_s);
  return r;
}

Receiver to_receiver(const LegacyFix& f, std::uint8_t status, HostStamp received) noexcept {
  Receiver r;
  r.known = true;
  r.received = received;
  r.fix = (status & kStatusGnssFix) != 0 ? 3 : 0;
  r.position_sigma = 1e-3 * f.horizontal_accuracy_mm / std::numbers::sqrt2;
  r.height_sigma = 1e-3 * f.vertical_accuracy_mm;
  r.velocity_sigma = 1e-2 * f.speed_accuracy_cm_s;
  return r;
}

void fill(const Mtdata2& d, const Receiver& receiver, HostStamp now, InsReading* r) noexcept {
  const std::uint32_t status = d.status_word ? *d.status_word : d.status_byte ? *d.status_byte : 0U;
  r->quality.status = status;
  r->quality.sync_out = d.status_word && (status & kStatusSyncOutMarker) != 0;
  fill_motion(d, d.orientation_frame, d.velocity_frame, &r->sample);
  const bool coasting = d.status_word && filter_mode(status) == 1;
  const bool fix = (status & kStatusGnssFix) != 0 && !coasting;
  fill_fix((status & kStatusFilterValid) != 0, fix, coasting, receiver, now, r);
  place(d.latitude_longitude_deg, d.altitude_ellipsoid_m, &r->sample);
  fill_utc(d.utc, kUtcValid, &r->quality);
}

void fill(const Mtdata& d, const Receiver& receiver, HostStamp now, InsReading* r) noexcept {
  const std::uint8_t status = d.status.value_or(0);
  r->quality.status = status;
  fill_motion(d, d.frame, d.frame, &r->sample);
  const bool fix = (status & kStatusGnssFix) != 0;
  // Without a fix a valid filter continues by inertia.
  fill_fix((status & kStatusFilterValid) != 0, fix, !fix, receiver, now, r);
  place(d.latitude_longitude_deg, d.altitude_m, &r->sample);
  fill_utc(d.utc, kUtcValid, &r->quality);
}

namespace {

using namespace xbus;

// Maximum age of a position while there is a fix.
constexpr Duration kWithoutPlace = Duration::milliseconds(200);

bool answers(const Message& m, MessageId request) noexcept {
  return m.id == static_cast<std::uint8_t>(static_cast<unsigned>(request) + 1U);
}

}  // namespace

void Decoder::begin(const StreamSettings& stream, std::uint32_t baud,
                    Duration processing) noexcept {
  set_ = stream;
  stream_.reset();
  const StreamCounters& c = stream_.counters();
  base_ = c.message_bytes + c.garbage_bytes;
  received_ = 0;
  timing_ = ArrivalTiming(baud, processing);
  sample_time_ = {};
  sample_counter_ = {};
  receiver_ = {};
  counted_ = false;
  replies_ = {};
  any_ = false;
  last_sample_ = {};
}

void Decoder::accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept {
  arrival_ = arrival;
  received_ += bytes.size();
  timing_.read(received_, arrival);
  // kMaxBytes fit in addition to any incomplete frame.
  (void)stream_.accept(bytes);
}

bool Decoder::woke() noexcept { return std::exchange(replies_.woke, false); }

bool Decoder::answered(MessageId request) noexcept {
  return std::exchange(request == MessageId::go_to_config ? replies_.stopped : replies_.going_on,
                       false);
}

bool Decoder::next(InsReading* reading) noexcept {
  for (Message m; stream_.next(&m);) {
    const StreamCounters& c = stream_.counters();
    const std::uint64_t end = c.message_bytes + c.garbage_bytes - base_;
    const std::uint64_t begin = end - frame_size(m.payload.size());
    if (m.is(MessageId::mtdata2) && set_.generation == Generation::mark4) {
      if (read_mtdata2(m, begin, end, reading)) return true;
    } else if (m.is(MessageId::mtdata) && set_.generation == Generation::legacy) {
      if (read_mtdata(m, begin, end, reading)) return true;
    } else {
      read_other(m);
    }
    timing_.other(end);
  }
  return false;
}

void Decoder::read_other(const Message& m) noexcept {
  if (m.is(MessageId::wake_up)) replies_.woke = true;
  if (answers(m, MessageId::go_to_config)) replies_.stopped = true;
  if (answers(m, MessageId::go_to_measurement)) replies_.going_on = replies_.resumed = true;
  if (m.is(MessageId::error) && !m.payload.empty() && m.payload[0] == kErrorPowerDip)
    replies_.woke = true;
}

void Decoder::count_messages(std::uint16_t counter) noexcept {
  if (counted_) {
    const auto ahead = static_cast<std::uint16_t>(counter - last_message_);
    // Larger steps mean a restart of the device.
    constexpr std::uint16_t kBelievable = 4096;
    if (ahead > 1 && ahead < kBelievable) counters_.lost += ahead - 1U;
  }
  counted_ = true;
  last_message_ = counter;
}

bool Decoder::step(ClockStep step) noexcept {
  if (step == ClockStep::restart) {
    ++counters_.restarts;
    timing_.restart();
    counted_ = false;
  }
  return step != ClockStep::backward;
}

bool Decoder::read_mtdata2(const Message& m, std::uint64_t begin, std::uint64_t end,
                           InsReading* reading) noexcept {
  Mtdata2 d;
  if (!decode_mtdata2(m.payload, &d)) {
    ++counters_.malformed;
    return false;
  }
  if (d.packet_counter) count_messages(*d.packet_counter);
  if (d.gnss_pvt) receiver_ = to_receiver(*d.gnss_pvt, arrival_);
  // A receiver's message has no sample of its own.
  if (!d.sample_time_fine || !(d.quaternion || d.latitude_longitude_deg)) {
    counters_.malformed += d.gnss_pvt || d.satellites || d.sample_time_fine ? 0U : 1U;
    return false;
  }
  if (!step(sample_time_.next(*d.sample_time_fine,
                              last_sample_ != HostStamp{} ? arrival_ - last_sample_ : Duration{})))
    return false;
  InsReading r;
  fill(d, receiver_, arrival_, &r);
  if (!finish(sample_time_.stamp(), begin, end, &r)) return false;
  const bool lacks_place =
      r.sample.fix == FixStatus::none && (r.quality.status & kStatusGnssFix) != 0;
  if (lacks_place && arrival_ - last_place_ < kWithoutPlace) return false;
  if (!lacks_place) last_place_ = arrival_;
  return hand_out(r, reading);
}

bool Decoder::read_mtdata(const Message& m, std::uint64_t begin, std::uint64_t end,
                          InsReading* reading) noexcept {
  Mtdata d;
  if (!decode_mtdata(m.payload, set_.layout, &d) || !d.sample_counter) {
    ++counters_.malformed;
    return false;
  }
  const double elapsed = last_sample_ != HostStamp{} ? (arrival_ - last_sample_).to_seconds() : 0;
  const std::int64_t before = sample_counter_.count();
  const ClockStep how =
      sample_counter_.next(*d.sample_counter, std::llround(elapsed * set_.rate_hz()));
  if (!step(how)) return false;
  if (how == ClockStep::forward)
    counters_.lost +=
        static_cast<std::uint64_t>(std::max<std::int64_t>(0, sample_counter_.count() - before - 1));
  if (d.fix) {
    // The block is repeated in every sample; its age decreases when it is new.
    if (d.fix->age <= last_fix_age_ || !receiver_.known)
      receiver_ = to_receiver(*d.fix, d.status.value_or(0), arrival_);
    last_fix_age_ = d.fix->age;
  }
  InsReading r;
  fill(d, receiver_, arrival_, &r);
  if (!finish(DeviceStamp(set_.time_ns(sample_counter_.count())), begin, end, &r)) return false;
  return hand_out(r, reading);
}

/// Just after a start the mapping still improves; a sample before the last output one would reverse
/// time.
bool Decoder::hand_out(const InsReading& r, InsReading* reading) noexcept {
  if (counters_.readings > 0 && r.host <= last_host_) return false;
  last_host_ = r.host;
  ++counters_.readings;
  *reading = r;
  reading->resumed = std::exchange(replies_.resumed, false);
  return true;
}

/// Returns false while the clocks are not mapped yet.
bool Decoder::finish(DeviceStamp measured, std::uint64_t begin, std::uint64_t end,
                     InsReading* r) noexcept {
  timing_.message(begin, end, measured);
  last_sample_ = arrival_;
  if (!timing_.known()) return false;
  if (any_) {
    const double periods = static_cast<double>((measured - last_).ns()) * 1e-9 * set_.rate_hz();
    number_ += static_cast<std::uint64_t>(std::max(1LL, std::llround(periods)));
  } else if (counters_.readings > 0) {
    // After a new start the number of missing samples is unknown.
    ++number_;
  }
  any_ = true;
  last_ = measured;
  const MappedStamp at = timing_.at(measured);
  r->sample.number = number_;
  r->measured = measured;
  r->arrival = arrival_;
  r->mapped = true;
  r->host = at.host;
  r->host_error = at.error;
  return true;
}

}  // namespace vergence::xsens
