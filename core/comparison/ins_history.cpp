#include "core/comparison/ins_history.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/comparison/comparison.hpp"

namespace vergence {
namespace {

// Maximum speed of a vehicle with this rig, in m/s.
constexpr double kFastest = 60.0;
// Duration of rejected stamps, at any rate, after which the INS's clock counts as set back
// permanently.
constexpr Duration kBackForGood = Duration::seconds(1);
// Minimum number of those samples; two may be a mistake.
constexpr int kMinBack = 3;
constexpr double kQuaternionLength = 0.1;
// Minimum horizontal part of a unit vector that determines a heading.
constexpr double kHorizontal = 0.5;
// Standard deviation in m of an unmeasured height.
constexpr double kUnknownHeight = 1000;
// Standard deviation in rad of an unmeasured tilt, by slopes and suspension.
constexpr double kLevelSigma = 0.05;

bool positive(double v) noexcept { return std::isfinite(v) && v > 0; }

bool read_attitude(const InsSample& s, Mat3* R) noexcept {
  const Eigen::Quaterniond q(s.q_enu_ins[3], s.q_enu_ins[0], s.q_enu_ins[1], s.q_enu_ins[2]);
  if (!s.attitude_valid || !(std::abs(q.norm() - 1.0) < kQuaternionLength)) return false;
  *R = q.normalized().toRotationMatrix();
  return true;
}

/// Attitude of a level vehicle at this yaw; kLevelSigma covers slopes.
Mat3 level_attitude(double yaw) noexcept { return exp_so3({0, 0, yaw}); }

double or_default(double sigma, double fallback) noexcept {
  return positive(sigma) ? sigma : fallback;
}

}  // namespace

InsHistory::InsHistory(const ComparisonOptions& options, ComparisonCounters& counters, Arena& arena)
    : options_(options),
      counters_(counters),
      readings_(arena.make<Reading>(options.ins_capacity, "comparison: INS samples")) {}

bool InsHistory::accept_stamp(Stamp stamp) noexcept {
  if (end_ > begin_ && stamp <= reading(end_ - 1).stamp) {
    ++counters_.ins_refused;
    if (!back_for_good(stamp)) return false;
    ++counters_.ins_restarts;
    begin_ = end_;
    last_fix_.reset();
  }
  refused_ = {};
  return true;
}

bool InsHistory::back_for_good(Stamp stamp) noexcept {
  if (refused_.count == 0 || stamp <= refused_.last) refused_ = {0, stamp, stamp};
  ++refused_.count;
  refused_.last = stamp;
  return refused_.count >= kMinBack && refused_.last - refused_.first >= kBackForGood;
}

void InsHistory::locate(const InsSample& sample, Reading* r) noexcept {
  const bool fixed = sample.fix == FixStatus::fix_2d || sample.fix == FixStatus::fix_3d;
  Mat3 R_local_ins;
  if (fixed && !sample.position.plausible()) ++counters_.ins_refused;
  bool attitude = read_attitude(sample, &R_local_ins);
  if (fixed && attitude && sample.position.plausible()) attitude = agrees(sample, R_local_ins);
  if (!attitude) {
    ++counters_.ins_without_attitude;
    if (sample.heading_source != HeadingSource::none && std::isfinite(sample.yaw_enu))
      yaw_ = sample.yaw_enu;
    if (sample.attitude_valid && attitude_check_.contradicted()) yaw_ = attitude_check_.course();
    // At standstill the last heading is used.
    R_local_ins = level_attitude(yaw_.value_or(0));
  }
  if (!fixed || !sample.position.plausible() || !(attitude || yaw_)) return;
  begin_plane(sample.position);
  r->valid = true;
  r->flat = sample.fix == FixStatus::fix_2d;
  // The height of a 2D fix may be 0 or years old.
  Geodetic position = sample.position;
  if (r->flat)
    position.height_m = height_.value_or(plane_.origin().height_m);
  else
    height_ = position.height_m;
  r->p_enu_ins = plane_.to_enu(position);
  r->R_enu_ins = plane_.rotation_from(position) * R_local_ins;
  r->sigmas.position = or_default(sample.position_sigma, options_.position_sigma_m);
  r->sigmas.height =
      r->flat ? kUnknownHeight : or_default(sample.height_sigma, options_.height_sigma_m);
  r->sigmas.tilt = attitude ? or_default(sample.tilt_sigma, options_.tilt_sigma_rad) : kLevelSigma;
}

void InsHistory::begin_plane(const Geodetic& position) noexcept {
  if (has_origin_) return;
  plane_ = LocalTangentPlane(position);
  has_origin_ = true;
}

/// Returns true if the attitude agrees with the direction of travel.
bool InsHistory::agrees(const InsSample& sample, const Mat3& R_local_ins) noexcept {
  begin_plane(sample.position);
  const Vec3 view = R_local_ins * options_.T_ins_left.R.col(2);
  // A vertical optical axis has no heading.
  if (view.head<2>().norm() < kHorizontal) return true;
  attitude_check_.add(plane_.to_enu(sample.position).head<2>(),
                      or_default(sample.position_sigma, options_.position_sigma_m),
                      std::atan2(view.y(), view.x()));
  if (!attitude_check_.contradicted()) return true;
  ++counters_.ins_contradicted;
  return false;
}

/// A receiver often has no fix for some samples when its position jumps, so compare with the last
/// fix and allow for driving since.
bool InsHistory::leapt(const Reading& r) noexcept {
  const std::optional<Fix> before = std::exchange(last_fix_, Fix{r.stamp, r.p_enu_ins, r.flat});
  if (!before) return false;
  const double farthest = options_.jump_m + kFastest * (r.stamp - before->stamp).to_seconds();
  Vec3 step = r.p_enu_ins - before->p_enu_ins;
  if (r.flat || before->flat) step.z() = 0;
  if (!(step.norm() > farthest)) return false;
  ++counters_.jumps;
  leaps_ = leaps_ ? Leaps{std::min(leaps_->first, r.stamp), std::max(leaps_->last, r.stamp)}
                  : Leaps{r.stamp, r.stamp};
  return true;
}

void InsHistory::add(const InsSample& sample) noexcept {
  ++counters_.ins_samples;
  if (!accept_stamp(sample.stamp)) return;
  Reading r;
  r.stamp = sample.stamp;
  locate(sample, &r);
  if (r.valid) r.jumped = leapt(r);
  if (end_ - begin_ == readings_.size()) ++begin_;
  readings_[static_cast<std::size_t>(end_) & (readings_.size() - 1)] = r;
  ++end_;
}

bool InsHistory::reaches(Stamp stamp) const noexcept {
  return end_ > begin_ && reading(end_ - 1).stamp >= stamp;
}

bool InsHistory::pop_leap(Stamp now) noexcept {
  if (!leaps_ || now < leaps_->first) return false;
  if (now >= leaps_->last) leaps_.reset();
  return true;
}

InsMatch InsHistory::reference_at(Stamp stamp, Reference* out) const noexcept {
  if (!reaches(stamp) || reading(begin_).stamp > stamp) return InsMatch::none;
  // Find the first reading not before the stamp.
  std::uint64_t low = begin_, high = end_ - 1;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (reading(middle).stamp < stamp)
      low = middle + 1;
    else
      high = middle;
  }
  const Reading& b = reading(low);
  const Reading& a = b.stamp == stamp || low == begin_ ? b : reading(low - 1);
  if (b.stamp - a.stamp > options_.max_gap) return InsMatch::gap;
  if (!a.valid || !b.valid) return InsMatch::no_fix;
  if (&a != &b && b.jumped) return InsMatch::jump;
  const Duration interval = b.stamp - a.stamp;
  const double s = interval.ns() > 0 ? static_cast<double>((stamp - a.stamp).ns()) /
                                           static_cast<double>(interval.ns())
                                     : 0.0;
  const Transform T_enu_ins =
      interpolate({a.R_enu_ins, a.p_enu_ins}, {b.R_enu_ins, b.p_enu_ins}, s);
  out->T_enu_left = T_enu_ins * options_.T_ins_left;
  out->flat = a.flat || b.flat;
  out->sigmas.position = std::max(a.sigmas.position, b.sigmas.position);
  out->sigmas.height = std::max(a.sigmas.height, b.sigmas.height);
  out->sigmas.tilt = std::max(a.sigmas.tilt, b.sigmas.tilt);
  return InsMatch::ok;
}

}  // namespace vergence
