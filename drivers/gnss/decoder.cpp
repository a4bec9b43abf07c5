#include "drivers/gnss/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/math/angle.hpp"

namespace vergence::gnss {

namespace {

using nmea::Sentence;
using nmea::Type;

constexpr std::int64_t kDay = 86'400'000'000'000;
// Maximum age of VTG and HDT, at 1 Hz and faster.
constexpr Duration kFresh = Duration::milliseconds(1100);

unsigned bit(Type type) noexcept { return 1U << static_cast<unsigned>(type); }

FixStatus to_fix_status(const Sentence& gga, bool has_height) noexcept {
  // NovAtel's 9 is a fix with satellite-based corrections.
  constexpr std::uint8_t kFirstFix = 1, kLastFix = 5, kEstimated = 6, kNovatelSbas = 9;
  if (gga.quality == kEstimated) return FixStatus::dead_reckoning;
  if (gga.quality < kFirstFix || (gga.quality > kLastFix && gga.quality != kNovatelSbas))
    return FixStatus::none;
  return has_height ? FixStatus::fix_3d : FixStatus::fix_2d;
}

}  // namespace

double yaw_of_heading(double heading_deg) noexcept {
  return std::remainder((90 - heading_deg) * kRadiansPerDegree, 2 * std::numbers::pi);
}

bool NmeaEpochs::accept(const Sentence& s, std::size_t bytes, HostStamp arrival,
                        Fix* fix) noexcept {
  if (s.type == Type::vtg) vtg_ = {s.speed, s.course_deg, arrival};
  if (s.type == Type::hdt && s.heading_deg) {
    heading_deg_ = s.heading_deg;
    heading_at_ = arrival;
  }
  if (s.type == Type::other) return false;
  if (!s.time_of_day_ns) {
    if (!open_) {
      usual_ |= s.type == Type::vtg || s.type == Type::hdt ? bit(s.type) : 0U;
      return false;
    }
    types_ |= bit(s.type);
  } else if (open_ && *s.time_of_day_ns == time_) {
    merge(s);
  } else if (!open_ && *s.time_of_day_ns == last_time_) {
    // The previous epoch was finished too early; the next one waits for this type.
    usual_ |= bit(s.type);
    return false;
  } else {
    const bool complete = flush(fix);
    begin(s, bytes, arrival);
    return complete;
  }
  return usual_ != 0 && (types_ & usual_) == usual_ && flush(fix);
}

bool NmeaEpochs::flush(Fix* fix) noexcept {
  if (!open_) return false;
  open_ = false;
  last_time_ = time_;
  usual_ = types_;
  if ((types_ & (bit(Type::gga) | bit(Type::rmc))) == 0) return false;
  finish(fix);
  return true;
}

void NmeaEpochs::restart() noexcept {
  open_ = false;
  usual_ = 0;
  vtg_ = {};
  heading_deg_.reset();
}

void NmeaEpochs::begin(const Sentence& s, std::size_t bytes, HostStamp arrival) noexcept {
  open_ = true;
  time_ = *s.time_of_day_ns;
  date_.reset();
  arrival_ = arrival;
  bytes_ = bytes;
  types_ = 0;
  merge(s);
}

void NmeaEpochs::merge(const Sentence& s) noexcept {
  types_ |= bit(s.type);
  if (s.type == Type::gga) gga_ = s;
  if (s.type == Type::gst) gst_ = s;
  if (s.type != Type::rmc) return;
  rmc_ = s;
  if (s.days) date_ = s.days;
}

/// Once a date is known, it advances at midnight.
DeviceStamp NmeaEpochs::stamp() noexcept {
  if (date_) {
    days_ = *date_;
    dated_ = true;
  } else if (time_ < previous_ - kDay / 2) {
    ++days_;
  }
  previous_ = time_;
  return DeviceStamp(days_ * kDay + time_);
}

void NmeaEpochs::finish(Fix* fix) noexcept {
  const bool has_gga = (types_ & bit(Type::gga)) != 0, has_rmc = (types_ & bit(Type::rmc)) != 0;
  Fix f;
  f.measured = stamp();
  f.arrival = arrival_;
  f.bytes = bytes_;
  InsSample& sample = f.reading.sample;
  InsQuality& quality = f.reading.quality;
  const Sentence& where = has_gga ? gga_ : rmc_;
  if (has_gga) {
    sample.fix = to_fix_status(gga_, gga_.altitude_m.has_value());
    sample.position.height_m = gga_.altitude_m.value_or(0) + gga_.geoid_m.value_or(0);
    quality.status = gga_.quality;
    quality.satellites = gga_.satellites;
    quality.position_dop = static_cast<float>(gga_.hdop.value_or(0));
  } else {
    sample.fix = rmc_.valid ? FixStatus::fix_2d : FixStatus::none;
  }
  if (where.latitude_deg && where.longitude_deg) {
    sample.position.latitude_deg = *where.latitude_deg;
    sample.position.longitude_deg = *where.longitude_deg;
  } else {
    sample.fix = FixStatus::none;
  }
  quality.filter_valid = sample.fix != FixStatus::none;
  if ((types_ & bit(Type::gst)) != 0 && gst_.latitude_sigma_m && gst_.longitude_sigma_m) {
    sample.position_sigma =
        std::hypot(*gst_.latitude_sigma_m, *gst_.longitude_sigma_m) / std::numbers::sqrt2;
    sample.height_sigma = gst_.altitude_sigma_m.value_or(0);
  }

  Motion motion{};
  if (has_rmc && rmc_.valid) motion = {rmc_.speed, rmc_.course_deg, arrival_};
  const bool vtg_fresh = arrival_ - vtg_.at < kFresh && vtg_.at != HostStamp{};
  if (!motion.speed && vtg_fresh) motion = vtg_;
  if (motion.speed && motion.course_deg) {
    const double yaw = yaw_of_heading(*motion.course_deg);
    sample.velocity_enu = {*motion.speed * std::cos(yaw), *motion.speed * std::sin(yaw), 0};
    if (*motion.speed >= kMoving) {
      sample.heading_source = HeadingSource::course;
      sample.yaw_enu = yaw;
    }
  }
  if (heading_deg_ && arrival_ - heading_at_ < kFresh) {
    sample.heading_source = HeadingSource::heading;
    sample.yaw_enu = yaw_of_heading(*heading_deg_);
  }
  if (dated_) {
    quality.utc_ns = f.measured.ns();
    quality.utc_valid = true;
  }
  *fix = f;
}

namespace {

// A larger step backwards means that the receiver's time was set.
constexpr Duration kClockSet = Duration::seconds(10);
// No receiver sends faster.
constexpr Duration kShortest = Duration::milliseconds(10);
// More missing epochs mean that the link was down or the time was set.
constexpr double kMaxLost = 1000;

ClockMapperOptions mapping(const Options& o) noexcept {
  ClockMapperOptions m;
  m.min_delay = o.processing;
  // A solution takes longer with more satellites.
  m.delay_spread = Duration::milliseconds(20);
  m.jump = Duration::milliseconds(200);
  m.resolution = Duration::milliseconds(1);
  return m;
}

FixStatus to_fix_status(const ubx::Pvt& p) noexcept {
  if (!p.fix_ok) return FixStatus::none;
  switch (p.fix) {
    case ubx::FixType::dead_reckoning:
      return FixStatus::dead_reckoning;
    case ubx::FixType::fix_2d:
      return FixStatus::fix_2d;
    case ubx::FixType::fix_3d:
    case ubx::FixType::combined:
      return FixStatus::fix_3d;
    case ubx::FixType::none:
    case ubx::FixType::time_only:
      break;
  }
  return FixStatus::none;
}

void fill(const ubx::Pvt& p, InsReading* r) noexcept {
  InsSample& s = r->sample;
  s.fix = to_fix_status(p);
  s.position = {p.latitude_deg, p.longitude_deg, p.height_m};
  // The horizontal accuracy combines both axes.
  s.position_sigma = p.horizontal_sigma_m / std::numbers::sqrt2;
  s.height_sigma = p.vertical_sigma_m;
  s.velocity_sigma = p.speed_sigma;
  s.velocity_enu = {p.velocity_ned[1], p.velocity_ned[0], -p.velocity_ned[2]};
  s.velocity_valid = s.fix != FixStatus::none;
  if (p.heading_deg) {
    s.heading_source = HeadingSource::heading;
    s.yaw_enu = yaw_of_heading(*p.heading_deg);
  } else if (s.velocity_valid && p.ground_speed >= kMoving) {
    s.heading_source = HeadingSource::course;
    s.yaw_enu = yaw_of_heading(p.course_deg);
  }
  if (s.heading_source != HeadingSource::none)
    s.heading_sigma = p.course_sigma_deg * kRadiansPerDegree;
  r->quality.status = static_cast<std::uint32_t>(p.fix);
  r->quality.satellites = p.satellites;
  r->quality.position_dop = static_cast<float>(p.position_dop);
  r->quality.filter_valid = p.fix_ok;
  r->quality.utc_ns = p.utc_ns.value_or(0);
  r->quality.utc_valid = p.utc_ns.has_value();
}

}  // namespace

Decoder::Decoder(const Options& options) noexcept : options_(options), mapper_(mapping(options)) {}

void Decoder::begin(std::uint32_t baud) noexcept {
  constexpr double kBitsOfByte = 10;
  byte_ns_ = baud == 0 ? 0 : kBitsOfByte * 1e9 / baud;
  mapper_.restart();
  nmea_.abandon();
  while (ubx_.waiting() > 0) {
    ubx_.abandon();
    for (ubx::Frame frame; ubx_.next(&frame);) {
    }
  }
  epochs_.restart();
  at_ = size_ = 0;
  quiet_ = false;
  any_ = false;
  // The receiver may have restarted at another rate.
  period_ = {};
}

void Decoder::accept(std::span<const std::uint8_t> bytes, HostStamp arrival) noexcept {
  size_ = std::min(bytes.size(), bytes_.size());
  std::copy_n(bytes.begin(), size_, bytes_.begin());
  at_ = 0;
  arrival_ = arrival;
  quiet_ = false;
}

bool Decoder::next(InsReading* reading) noexcept {
  for (Fix fix; options_.protocol == Protocol::nmea ? next_nmea(&fix) : next_ubx(&fix);)
    if (map(fix, reading)) return true;
  return false;
}

bool Decoder::next_nmea(Fix* fix) noexcept {
  if (at_ == 0) (void)ubx_.accept(std::span(bytes_).first(size_));
  for (ubx::Frame frame; ubx_.next(&frame);) {
  }
  while (at_ < size_) {
    nmea::Sentence sentence;
    if (!nmea_.accept(bytes_[at_++], &sentence)) continue;
    if (sentence.type == nmea::Type::gga || sentence.type == nmea::Type::rmc) ++fixes_;
    if (epochs_.accept(sentence, nmea_.size(), arrival_, fix)) return true;
  }
  return std::exchange(quiet_, false) && epochs_.flush(fix);
}

bool Decoder::next_ubx(Fix* fix) noexcept {
  if (at_ < size_) {
    for (nmea::Sentence ignored; at_ < size_;) (void)nmea_.accept(bytes_[at_++], &ignored);
    (void)ubx_.accept(std::span(bytes_).first(size_));
  }
  for (;;) {
    for (ubx::Frame frame; ubx_.next(&frame);) {
      if (!frame.is_pvt()) continue;
      ubx::Pvt pvt;
      if (!ubx::decode_pvt(frame.payload, &pvt)) {
        ++counters_.malformed;
        continue;
      }
      ++fixes_;
      if (!pvt.utc_ns) continue;
      *fix = {};
      fix->measured = DeviceStamp(*pvt.utc_ns);
      fix->arrival = arrival_;
      fix->bytes = frame.payload.size() + ubx::kOverhead;
      fill(pvt, &fix->reading);
      return true;
    }
    // An incomplete frame on a quiet link is discarded; it may contain a complete one.
    if (!quiet_ || ubx_.waiting() == 0) break;
    ubx_.abandon();
  }
  quiet_ = false;
  return false;
}

void Decoder::Period::add(Duration step) noexcept {
  constexpr int kMinConsistent = 3;
  constexpr double kRelativeTolerance = 0.25;
  const double apart = std::abs(step.to_seconds() - newest_.to_seconds());
  alike_ = alike_ > 0 && apart <= kRelativeTolerance * newest_.to_seconds() ? alike_ + 1 : 1;
  newest_ = step;
  const bool believed = alike_ >= kMinConsistent;
  if (interval_ == Duration{} || (believed && (!sure_ || step < interval_))) interval_ = step;
  sure_ = sure_ || believed;
}

void Decoder::count(Duration step) noexcept {
  if (step >= kShortest) period_.add(step);
  const Duration period = period_.interval();
  const double periods = period == Duration{} ? 1 : step.to_seconds() / period.to_seconds();
  const auto steps = static_cast<std::uint64_t>(std::llround(std::clamp(periods, 1.0, kMaxLost)));
  number_ += steps;
  counters_.lost += steps - 1;
}

/// Without a fix the time may be that of the receiver's own clock, which deviates by tenths of a
/// second overnight, so it is not used for the mapping.
MappedStamp Decoder::host_stamp(const Fix& fix, HostStamp arrival) noexcept {
  constexpr Duration kClose = Duration::seconds(1);
  if (fix.reading.sample.fix != FixStatus::none) return mapper_.map(fix.measured, arrival);
  const MappedStamp of_arrival{arrival - options_.processing, kClose};
  if (!mapper_.known()) return of_arrival;
  const MappedStamp fitted = mapper_.at(fix.measured);
  const Duration apart = fitted.host - of_arrival.host;
  return apart < kClose && Duration{} - apart < kClose ? fitted : of_arrival;
}

bool Decoder::map(const Fix& fix, InsReading* reading) noexcept {
  best_heading_ = std::max(best_heading_, fix.reading.sample.heading_source);
  if (any_) {
    const Duration step = fix.measured - last_;
    if (step < Duration{} - kClockSet || step > Duration::seconds(86400)) {
      ++counters_.restarts;
      mapper_.restart();
      ++number_;
    } else if (step <= Duration{}) {
      return false;
    } else {
      count(step);
    }
  } else if (counters_.readings > 0) {
    // After a disconnect the number of missing fixes is unknown.
    ++number_;
  }
  any_ = true;
  last_ = fix.measured;
  const Duration on_wire =
      Duration::nanoseconds(std::llround(byte_ns_ * static_cast<double>(fix.bytes)));
  const MappedStamp mapped = host_stamp(fix, fix.arrival - on_wire);
  // The mapping still improves after a start, which could reverse time.
  if (counters_.readings > 0 && mapped.host <= last_host_) return false;
  last_host_ = mapped.host;
  ++counters_.readings;
  InsReading r = fix.reading;
  r.sample.number = number_;
  r.measured = fix.measured;
  r.arrival = arrival_;
  r.mapped = true;
  r.host = mapped.host;
  r.host_error = mapped.error;
  *reading = r;
  return true;
}

DecoderCounters Decoder::counters() const noexcept {
  DecoderCounters c = counters_;
  c.malformed += options_.protocol == Protocol::nmea
                     ? nmea_.counters().malformed + nmea_.counters().checksum_wrong
                     : ubx_.counters().checksum_wrong + ubx_.counters().length_refused;
  return c;
}

}  // namespace vergence::gnss
