#include "app/recorder/records.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>

namespace vergence::app {
namespace {

/// The words of events.jsonl, in the order of EstimatorEvent::Kind.
const char* kind_word(EstimatorEvent::Kind kind) noexcept {
  switch (kind) {
    case EstimatorEvent::Kind::state:
      return "state";
    case EstimatorEvent::Kind::scene_restarted:
      return "scene_restarted";
    case EstimatorEvent::Kind::time_gap:
      return "time_gap";
    case EstimatorEvent::Kind::relocalised:
      return "relocalised";
    case EstimatorEvent::Kind::dropped:
      return "dropped";
    case EstimatorEvent::Kind::rig_changed:
      return "rig_changed";
    case EstimatorEvent::Kind::calibration_confirmed:
      return "calibration_confirmed";
    case EstimatorEvent::Kind::calibration_accepted:
      return "calibration_accepted";
    case EstimatorEvent::Kind::calibration_rejected:
      return "calibration_rejected";
    case EstimatorEvent::Kind::calibration_waits:
      return "calibration_waits";
  }
  return "";
}

}  // namespace

PoseNumbers PoseNumbers::of(const Transform& T) noexcept {
  const Eigen::Quaterniond q = quaternion(T.R);
  return {{T.t.x(), T.t.y(), T.t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

Transform PoseNumbers::transform() const noexcept {
  return {Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix(), Vec3(t[0], t[1], t[2])};
}

PoseRecord PoseRecord::of(const PoseSample& sample, float decode_ms, const std::optional<Transform>& T_reference_left) noexcept {
  PoseRecord r;
  r.frame = sample.frame;
  r.stamp = sample.stamp;
  r.state = sample.state;
  r.status = sample.status;
  r.reason = sample.reason;
  r.world_left = PoseNumbers::of(sample.T_world_left);
  r.has_reference = T_reference_left.has_value();
  if (T_reference_left) r.reference_left = PoseNumbers::of(*T_reference_left);
  r.inliers = sample.inliers;
  r.reprojection_px = sample.reprojection_px;
  r.stage_ms = sample.stage_ms;
  r.estimate_ms = sample.estimate_ms;
  r.decode_ms = decode_ms;
  return r;
}

EarthNumbers EarthNumbers::of(const EarthPose& pose) noexcept {
  const Vec3& t = pose.T_enu_left.t;
  return {{t.x(), t.y(), t.z()}, pose.position, compass_heading_deg(pose.yaw)};
}

PoseRecord PoseRecord::of(const ComparedPose& pose, float decode_ms) noexcept {
  PoseRecord r = of(pose.pose, decode_ms, pose.ins_valid ? std::optional(pose.reference.T_enu_left) : std::nullopt);
  r.placed = pose.placed;
  r.ins_valid = pose.ins_valid;
  r.compared = pose.compared;
  if (pose.placed) r.ours = EarthNumbers::of(pose.ours);
  if (pose.ins_valid) r.ins = EarthNumbers::of(pose.reference);
  // A compass counts clockwise, a yaw the other way.
  r.error = {pose.error_enu.x(), pose.error_enu.y(), pose.error_enu.z(), -pose.error_yaw * (180.0 / std::numbers::pi)};
  return r;
}

void EventRecord::set_sentence(std::string_view text) noexcept {
  std::size_t n = std::min(text.size(), sentence.size() - 1);
  if (n < text.size())
    while (n > 0 && (static_cast<unsigned char>(text[n]) & 0xc0U) == 0x80U) --n;
  std::copy_n(text.begin(), n, sentence.begin());
  sentence[n] = 0;
}

EventRecord EventRecord::of(const EstimatorEvent& event) noexcept {
  EventRecord r;
  r.stamp = event.stamp;
  r.kind = kind_word(event.kind);
  const bool state = event.kind == EstimatorEvent::Kind::state;
  if (state) {
    std::array<char, 256> text{};
    const auto from = to_string(event.from), to = to_string(event.to);
    std::snprintf(text.data(), text.size(), "%.*s to %.*s: %s", static_cast<int>(from.size()), from.data(), static_cast<int>(to.size()),
                  to.data(), event.why);
    r.set_sentence(text.data());
    // The words are string literals: views of them end with 0.
    r.fields[0] = {"from", from.data()};
    r.fields[1] = {"to", to.data()};
  } else {
    r.set_sentence(event.why);
    r.fields[0] = {"value", event.value};
  }
  return r;
}

CalibrationRecord CalibrationRecord::of(const RigCalibration& rig, Stamp stamp, bool accepted, const char* source,
                                        const char* reason) noexcept {
  CalibrationRecord r;
  r.stamp = stamp;
  r.accepted = accepted;
  r.source = source;
  r.reason = reason;
  r.frames = rig.frames;
  r.reprojection_px = rig.reprojection_px;
  r.cameras = rig.cameras;
  for (std::size_t k = 1; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Vec3 phi = log_so3(rig.T_camera_left[k].R), &t = rig.T_camera_left[k].t;
    r.extra[k] = {{phi.x(), phi.y(), phi.z(), t.x(), t.y(), t.z()}, rig.sigma_noise[k], rig.sigma_wide[k]};
  }
  return r;
}

}  // namespace vergence::app
