#include "drivers/xsens/convert.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "core/math/angle.hpp"

namespace vergence::xsens {
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

/// What both generations' status bits say alike.
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
  std::optional<std::array<double, 4>> q = d.quaternion;
  if (!q && d.euler_deg) q = quaternion_of_euler(*d.euler_deg);
  if (!q && d.rotation_matrix) q = quaternion_of_matrix(*d.rotation_matrix);
  if (q) {
    if (const auto enu = enu_attitude(*q, orientation_frame)) {
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
  constexpr double kLeast = 0.9, kMost = 1.1;  // what 12.20 rounds is far inside
  if (!(n > kLeast && n < kMost)) return std::nullopt;
  const Eigen::Quaterniond enu = enu_from(frame) * Eigen::Quaterniond(q.coeffs() / n);
  return std::array{enu.x(), enu.y(), enu.z(), enu.w()};
}

std::array<double, 4> quaternion_of_euler(const Three& deg) noexcept {
  const Eigen::Quaterniond q =
      Eigen::AngleAxisd(deg[2] * kRadiansPerDegree, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(deg[1] * kRadiansPerDegree, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(deg[0] * kRadiansPerDegree, Eigen::Vector3d::UnitX());
  return {q.w(), q.x(), q.y(), q.z()};
}

std::array<double, 4> quaternion_of_matrix(const std::array<double, 9>& rows) noexcept {
  const Eigen::Quaterniond q(
      Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data())));
  return {q.w(), q.x(), q.y(), q.z()};
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

Receiver receiver_of(const GnssPvt& p, HostStamp received) noexcept {
  constexpr std::uint32_t kUnknown = 0xFFFFFFFF;
  constexpr std::uint16_t kNoDop = 9999;
  const auto metres = [](std::uint32_t mm) { return mm == kUnknown ? 0 : 1e-3 * mm; };
  Receiver r;
  r.known = true;
  r.received = received;
  r.fix = (p.flags & 1U) != 0 ? p.fix : std::uint8_t{0};
  r.satellites = p.satellites;
  if (p.dop_1e2[1] != kNoDop) r.position_dop = 0.01F * static_cast<float>(p.dop_1e2[1]);
  // The receiver's horizontal accuracy is of the plane, both axes together.
  r.position_sigma = metres(p.horizontal_accuracy_mm) / std::numbers::sqrt2;
  r.height_sigma = metres(p.vertical_accuracy_mm);
  r.velocity_sigma = metres(p.speed_accuracy_mm_s);
  return r;
}

Receiver receiver_of(const LegacyFix& f, std::uint8_t status, HostStamp received) noexcept {
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
  // Without a fix a valid filter goes on by inertia.
  fill_fix((status & kStatusFilterValid) != 0, fix, !fix, receiver, now, r);
  place(d.latitude_longitude_deg, d.altitude_m, &r->sample);
  fill_utc(d.utc, kUtcValid, &r->quality);
}

}  // namespace vergence::xsens
