#include "core/comparison/comparison.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace vergence {
namespace {

constexpr double kFastest = 60.0;  // m/s: no vehicle that carries this rig
constexpr double kLeastStep =
    0.05;  // m: smaller steps are the odometry's noise at a standstill, not a way
constexpr int kBackwardsForGood =
    120;  // samples in a row: a second of an INS whose clock has gone back and stays there
constexpr double kQuaternionLength = 0.1;
constexpr double kLevelSigma = 0.05;  // rad: slopes and suspension, where nobody measures tilt
constexpr double kSigmas = 4.0;       // of the path ratio, before scale_disagrees is said

bool positive(double v) noexcept { return std::isfinite(v) && v > 0; }

bool attitude_of(const InsSample& s, Mat3* R) noexcept {
  const Eigen::Quaterniond q(s.q_enu_ins[3], s.q_enu_ins[0], s.q_enu_ins[1], s.q_enu_ins[2]);
  if (!s.attitude_valid || !(std::abs(q.norm() - 1.0) < kQuaternionLength)) return false;
  *R = q.normalized().toRotationMatrix();
  return true;
}

/// A vehicle on a road, at this yaw: level but for its slope, which kLevelSigma covers.
Mat3 level_at(double yaw) noexcept { return exp_so3({0, 0, yaw}); }

double or_default(double sigma, double fallback) noexcept {
  return positive(sigma) ? sigma : fallback;
}

double wrapped(double angle) noexcept { return std::remainder(angle, 2.0 * std::numbers::pi); }

}  // namespace

const char* ComparisonOptions::validate() const noexcept {
  if (!T_ins_left.finite()) return "the lever arm or the boresight is not a number";
  if (!positive(placement_m)) return "placement_m must be more than 0 m";
  if (!positive(correlation_s)) return "correlation_s must be more than 0 s";
  if (!positive(position_sigma_m) || !positive(height_sigma_m) || !positive(tilt_sigma_rad))
    return "every sigma must be more than 0";
  if (!(heading_sigma_rad >= 0)) return "heading_sigma must be 0 or more";
  if (max_gap <= Duration{} || max_wait <= Duration{})
    return "max_gap and max_wait must be more than 0 s";
  if (!positive(jump_m)) return "jump_m must be more than 0 m";
  if (!positive(scale_stretch_m) || !positive(scale_tolerance))
    return "scale_stretch_m and scale_tolerance must be more than 0";
  if (!std::has_single_bit(ins_capacity) || ins_capacity < 16)
    return "ins_capacity must be a power of two, 16 or more";
  return nullptr;
}

namespace {

/// Forward-left-up from right-down-forward.
Mat3 body_from_camera() noexcept {
  Mat3 R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R;
}

}  // namespace

Transform mount_of(const Vec3& lever_arm_m, const Vec3& boresight_rad) noexcept {
  const Mat3 turned = exp_so3({0, 0, boresight_rad.z()}) * exp_so3({0, boresight_rad.y(), 0}) *
                      exp_so3({boresight_rad.x(), 0, 0});
  return {turned * body_from_camera(), lever_arm_m};
}

Vec3 boresight_of(const Mat3& R_ins_left) noexcept {
  const Mat3 R = R_ins_left * body_from_camera().transpose();
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
          std::atan2(R(1, 0), R(0, 0))};
}

const char* to_string(InsMatch m) noexcept {
  static constexpr std::array<const char*, 5> names = {"ok", "none", "gap", "no_fix", "jump"};
  return names[static_cast<std::size_t>(m)];
}

Comparison::Comparison(const ComparisonOptions& options, Arena& arena)
    : options_(options),
      readings_(arena.make<Reading>(options.ins_capacity, "comparison: INS samples")),
      pairs_(arena.make<PlacementPair>(kPlacementPairs, "comparison: placement")) {
  assert(options.validate() == nullptr);
}

std::size_t Comparison::bytes_needed(const ComparisonOptions& options) noexcept {
  return options.ins_capacity * sizeof(Reading) + kPlacementPairs * sizeof(PlacementPair) +
         2 * kCacheLine;
}

void Comparison::add(const InsSample& sample) noexcept {
  ++counters_.ins_samples;
  if (end_ > begin_ && sample.stamp <= reading(end_ - 1).stamp) {
    ++counters_.ins_refused;
    if (++backwards_ < kBackwardsForGood) return;
    ++counters_.ins_restarts;
    begin_ = end_;
  }
  backwards_ = 0;

  Reading r;
  r.stamp = sample.stamp;
  r.stamp_error = sample.stamp_error;
  const bool fixed = sample.fix == FixStatus::fix_2d || sample.fix == FixStatus::fix_3d;
  Mat3 R_local_ins;
  if (fixed && !sample.position.plausible()) ++counters_.ins_refused;
  const bool attitude = attitude_of(sample, &R_local_ins);
  if (!attitude) {
    ++counters_.ins_without_attitude;
    if (sample.heading_source != HeadingSource::none && std::isfinite(sample.yaw_enu)) {
      yaw_ = sample.yaw_enu;
      has_yaw_ = true;
    }
    R_local_ins = level_at(yaw_);  // at a standstill the last heading holds
  }
  if (fixed && sample.position.plausible() && (attitude || has_yaw_)) {
    if (!has_origin_) {
      plane_ = LocalTangentPlane(sample.position);
      has_origin_ = true;
    }
    r.valid = true;
    r.p_enu_ins = plane_.to_enu(sample.position);
    r.R_enu_ins = plane_.rotation_from(sample.position) * R_local_ins;
    r.position_sigma = or_default(sample.position_sigma, options_.position_sigma_m);
    r.height_sigma = or_default(sample.height_sigma, options_.height_sigma_m);
    r.tilt_sigma = attitude ? or_default(sample.tilt_sigma, options_.tilt_sigma_rad) : kLevelSigma;
    if (end_ > begin_ && reading(end_ - 1).valid) {
      const Reading& before = reading(end_ - 1);
      const double farthest = options_.jump_m + kFastest * (r.stamp - before.stamp).to_seconds();
      r.jumped = (r.p_enu_ins - before.p_enu_ins).norm() > farthest;
      if (r.jumped) {
        ++counters_.jumps;
        leapt_ = true;
        leapt_at_ = r.stamp;
      }
    }
  }
  if (end_ - begin_ == readings_.size()) ++begin_;
  readings_[static_cast<std::size_t>(end_) & (readings_.size() - 1)] = r;
  ++end_;
}

void Comparison::add(const PoseSample& pose) noexcept {
  assert(pending_end_ - pending_begin_ < kPending);
  pending_[static_cast<std::size_t>(pending_end_ % kPending)] = pose;
  ++pending_end_;
}

bool Comparison::ready(const PoseSample& pose) const noexcept {
  if (finishing_ || pending_end_ - pending_begin_ == kPending) return true;
  if (end_ > begin_ && reading(end_ - 1).stamp >= pose.stamp) return true;
  return pending_[static_cast<std::size_t>((pending_end_ - 1) % kPending)].stamp - pose.stamp >
         options_.max_wait;
}

InsMatch Comparison::reference_at(Stamp stamp, ComparedPose* out, Reading* sigmas) const noexcept {
  if (end_ == begin_ || reading(end_ - 1).stamp < stamp || reading(begin_).stamp > stamp)
    return InsMatch::none;
  std::uint64_t low = begin_,
                high = end_ -
                       1;  // the first reading not before the stamp; at most log2(capacity) turns
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
  out->reference = on_earth(T_enu_ins * options_.T_ins_left);
  out->ins_stamp_error = std::max(a.stamp_error, b.stamp_error);
  sigmas->position_sigma = std::max(a.position_sigma, b.position_sigma);
  sigmas->height_sigma = std::max(a.height_sigma, b.height_sigma);
  sigmas->tilt_sigma = std::max(a.tilt_sigma, b.tilt_sigma);
  return InsMatch::ok;
}

EarthPose Comparison::on_earth(const Transform& T_enu_left) const {
  const Vec3 view = T_enu_left.R.col(2);
  return {T_enu_left, plane_.to_geodetic(T_enu_left.t), std::atan2(view.y(), view.x())};
}

void Comparison::collect(const ComparedPose& c, const Reading& sigmas) noexcept {
  const Transform& T_world_left = c.pose.T_world_left;
  if (has_last_) {
    const double step = (T_world_left.t - last_world_).norm();
    if (step < kLeastStep) return;
    driven_ += step;
  }
  last_world_ = T_world_left.t;
  has_last_ = true;
  if (driven_ >= next_pair_at_) {
    const PlacementPair pair{c.pose.stamp,
                             T_world_left.t,
                             c.reference.T_enu_left.t,
                             c.reference.T_enu_left.R * T_world_left.R.transpose(),
                             sigmas.position_sigma,
                             sigmas.height_sigma,
                             sigmas.tilt_sigma,
                             options_.heading_sigma_rad};
    if (!pairs_.push(pair))
      pairs_.back() = pair;  // full: the newest is the farthest, it holds the heading best
    next_pair_at_ = driven_ + options_.placement_m / static_cast<double>(kPlacementPairs);
  }
  if (driven_ < options_.placement_m) return;
  place();
  if (placement_status_ != PlacementStatus::ok)
    begin_collecting();  // a way that holds no heading: the next one may
}

void Comparison::begin_collecting() noexcept {
  collecting_ = true;
  pairs_.clear();
  has_last_ = false;
  driven_ = 0;
  next_pair_at_ = 0;
}

void Comparison::place() noexcept {
  placement_status_ =
      fit_placement(pairs_.span(), Duration::seconds(options_.correlation_s), &placement_);
  if (placement_status_ != PlacementStatus::ok) return;
  placement_.distance = driven_;
  collecting_ = false;
}

void Comparison::measure_scale(const Reading& sigmas, ComparedPose* c) noexcept {
  const Vec3& ours = c->pose.T_world_left.t;
  const Vec3& ins = c->reference.T_enu_left.t;
  if (!has_anchor_) {
    has_anchor_ = true;
    anchor_ours_ = ours;
    anchor_ins_ = ins;
  } else if ((ours - anchor_ours_).norm() >= options_.scale_stretch_m / kChords) {
    chords_[static_cast<std::size_t>(chord_count_ % kChords)] = {(ours - anchor_ours_).norm(),
                                                                 (ins - anchor_ins_).norm()};
    ++chord_count_;
    anchor_ours_ = ours;
    anchor_ins_ = ins;
    if (chord_count_ >= kChords) {
      Chord sum;
      for (const Chord& chord : chords_) {
        sum.ours += chord.ours;
        sum.ins += chord.ins;
      }
      ratio_ = sum.ins > 0 ? sum.ours / sum.ins : 0.0;
      // Errors of neighbouring fixes go together: what remains over the stretch is the difference
      // of its two ends.
      const double sigma = std::numbers::sqrt2 * sigmas.position_sigma / options_.scale_stretch_m;
      disagrees_ = ratio_ > 0 &&
                   std::abs(ratio_ - 1.0) > std::max(options_.scale_tolerance, kSigmas * sigma);
    }
  }
}

bool Comparison::next(ComparedPose* out) noexcept {
  if (pending_begin_ == pending_end_) {
    if (finishing_ && placement_.revision == 0 && !pairs_.empty()) place();
    return false;
  }
  const PoseSample& pose = pending_[static_cast<std::size_t>(pending_begin_ % kPending)];
  if (!ready(pose)) return false;
  if (!finishing_ && pending_end_ - pending_begin_ == kPending) ++counters_.pushed_out;

  ComparedPose c;
  c.pose = pose;
  Reading sigmas;
  c.ins = reference_at(pose.stamp, &c, &sigmas);
  c.ins_valid = c.ins == InsMatch::ok;
  if (!c.ins_valid) ++counters_.without_ins;
  // What was before a leap and what comes after do not fit together, also when no frame fell
  // between the two readings.
  if (leapt_ && pose.stamp >= leapt_at_) {
    leapt_ = false;
    has_anchor_ = false;
    if (collecting_) begin_collecting();
  }

  const bool posed = pose.status != PoseStatus::lost && pose.T_world_left.finite();
  const bool restarted = pose.reason == Reason::scene_restarted;
  if (restarted && !restarted_) begin_collecting();
  restarted_ = restarted;
  if (posed && c.ins_valid) {
    if (collecting_) collect(c, sigmas);
    measure_scale(sigmas, &c);
  } else {
    has_last_ = false;  // a way across a hole is not a way driven with a fix
    has_anchor_ = false;
  }
  c.path_ratio = ratio_;
  c.scale_disagrees = disagrees_;

  c.placement_revision = placement_.revision;
  c.placed = posed && placement_.revision > 0;
  if (c.placed) c.ours = on_earth(placement_.T_enu_world * pose.T_world_left);
  c.compared = c.placed && c.ins_valid;
  if (c.compared) {
    c.error_enu = c.ours.T_enu_left.t - c.reference.T_enu_left.t;
    c.error_yaw = wrapped(c.ours.yaw - c.reference.yaw);
    ++counters_.compared;
  }
  ++pending_begin_;
  *out = c;
  return true;
}

}  // namespace vergence
