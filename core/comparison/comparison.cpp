#include "core/comparison/comparison.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace vergence {
namespace {

double wrapped(double angle) noexcept { return std::remainder(angle, 2.0 * std::numbers::pi); }

/// Rotation from right-down-forward to forward-left-up axes.
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
    : options_(options), ins_(options_, counters_, arena), builder_(options_, arena) {}

void Comparison::add(const PoseSample& pose) noexcept {
  assert(pending_end_ - pending_begin_ < kPending);
  pending_[static_cast<std::size_t>(pending_end_ % kPending)] = pose;
  ++pending_end_;
}

bool Comparison::ready(const PoseSample& pose) const noexcept {
  if (finishing_ || pending_end_ - pending_begin_ == kPending) return true;
  if (ins_.reaches(pose.stamp)) return true;
  return pending_[static_cast<std::size_t>((pending_end_ - 1) % kPending)].stamp - pose.stamp >
         options_.max_wait;
}

EnuPose Comparison::in_enu(const Transform& T_enu_left) const {
  const Vec3 view = T_enu_left.R.col(2);
  return {T_enu_left, ins_.plane().to_geodetic(T_enu_left.t), std::atan2(view.y(), view.x())};
}

void Comparison::take(const ComparedPose& c, const InsHistory::Reference& reference) noexcept {
  const Transform& T_world_left = c.pose.T_world_left;
  const Transform& T_enu_left = reference.T_enu_left;
  if (builder_.collecting())
    builder_.add({c.pose.stamp, T_world_left.t, T_enu_left.t,
                  T_enu_left.R * T_world_left.R.transpose(), reference.sigmas.position,
                  reference.sigmas.height, reference.sigmas.tilt, options_.heading_sigma_rad});
  // A step between measured and unmeasured height is not part of the path.
  if (std::exchange(flat_, reference.flat) != reference.flat) ratio_.interrupt();
  ratio_.add(T_world_left.t, T_enu_left.t, reference.sigmas.position, options_);
}

bool Comparison::next(ComparedPose* out) noexcept {
  if (pending_begin_ == pending_end_) {
    if (finishing_) builder_.finish();
    return false;
  }
  const PoseSample& pose = pending_[static_cast<std::size_t>(pending_begin_ % kPending)];
  if (!ready(pose)) return false;
  if (!finishing_ && pending_end_ - pending_begin_ == kPending) ++counters_.pushed_out;

  ComparedPose c;
  c.pose = pose;
  InsHistory::Reference reference;
  c.ins = ins_.reference_at(pose.stamp, &reference);
  c.ins_valid = c.ins == InsMatch::ok;
  if (c.ins_valid) {
    c.reference = in_enu(reference.T_enu_left);
    c.ins_position_sigma = reference.sigmas.position;
    c.height_known = !reference.flat;
  } else {
    ++counters_.without_ins;
  }
  // Samples before and after a jump do not fit together, even if no frame was between the two.
  if (ins_.pop_leap(pose.stamp)) {
    ratio_.interrupt();
    if (builder_.collecting()) builder_.restart();
  }

  const bool posed = pose.status != PoseStatus::lost && pose.T_world_left.finite();
  const bool restarted = pose.reason == Reason::map_reset;
  if (restarted && !restarted_) builder_.restart();
  restarted_ = restarted;
  if (posed && c.ins_valid) {
    take(c, reference);
  } else {
    // A path across a gap does not count as driven with a fix.
    builder_.interrupt();
    ratio_.interrupt();
  }
  c.path_ratio = ratio_.value();
  c.scale_disagrees = ratio_.disagrees();

  const EnuAlignment& alignment = builder_.alignment();
  c.placed = posed && alignment.revision > 0;
  if (c.placed) c.estimate = in_enu(alignment.T_enu_world * pose.T_world_left);
  c.compared = c.placed && c.ins_valid;
  if (c.compared) {
    c.error_enu = c.estimate.T_enu_left.t - c.reference.T_enu_left.t;
    if (!c.height_known) c.error_enu.z() = 0;
    c.error_yaw = wrapped(c.estimate.yaw - c.reference.yaw);
    ++counters_.compared;
  }
  ++pending_begin_;
  *out = c;
  return true;
}

}  // namespace vergence
