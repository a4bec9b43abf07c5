#include "drivers/gnss/nmea_epochs.hpp"

#include <cmath>
#include <numbers>

#include "core/math/angle.hpp"

namespace vergence::gnss {
namespace {

using nmea::Sentence;
using nmea::Type;

constexpr std::int64_t kDay = 86'400'000'000'000;
constexpr Duration kFresh = Duration::milliseconds(1100);  // VTG and HDT, at 1 Hz and faster

unsigned bit(Type type) noexcept { return 1U << static_cast<unsigned>(type); }

FixStatus fix_of(const Sentence& gga, bool has_height) noexcept {
  // NovAtel's 9 is a fix with corrections of satellites.
  constexpr std::uint8_t kFirstFix = 1, kLastFix = 5, kEstimated = 6, kOfNovatel = 9;
  if (gga.quality == kEstimated) return FixStatus::dead_reckoning;
  if (gga.quality < kFirstFix || (gga.quality > kLastFix && gga.quality != kOfNovatel))
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
    usual_ |= bit(s.type);  // the epoch before was finished too soon: the next one waits for it
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

/// Once a date was known it goes on by midnights.
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
    sample.fix = fix_of(gga_, gga_.altitude_m.has_value());
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

}  // namespace vergence::gnss
