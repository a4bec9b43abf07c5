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
    case EstimatorEvent::Kind::in_step:
      return "in_step";
    case EstimatorEvent::Kind::calibration_confirmed:
      return "calibration_confirmed";
    case EstimatorEvent::Kind::calibration_contradicted:
      return "calibration_contradicted";
    case EstimatorEvent::Kind::focal_length_contradicted:
      return "focal_length_contradicted";
    case EstimatorEvent::Kind::calibration_accepted:
      return "calibration_accepted";
    case EstimatorEvent::Kind::calibration_rejected:
      return "calibration_rejected";
    case EstimatorEvent::Kind::calibration_taken_up:
      return "calibration_taken_up";
    case EstimatorEvent::Kind::calibration_waits:
      return "calibration_waits";
    case EstimatorEvent::Kind::calibration_resumed:
      return "calibration_resumed";
  }
  return "";
}

/// What stands before the reason that the estimator gives.
const char* opening(EstimatorEvent::Kind kind) noexcept {
  switch (kind) {
    case EstimatorEvent::Kind::calibration_accepted:
      return "a new calibration is in use";
    case EstimatorEvent::Kind::calibration_rejected:
      return "a calibration was rejected";
    case EstimatorEvent::Kind::calibration_waits:
      return "the calibration waits";
    case EstimatorEvent::Kind::calibration_resumed:
      return "the last calibration is in use again";
    default:
      return "";
  }
}

/// As much of the text as fits, in whole UTF-8 characters, with a 0 behind it.
template <std::size_t N>
void copy_text(std::string_view text, std::array<char, N>* out) noexcept {
  std::size_t n = std::min(text.size(), N - 1);
  if (n < text.size())
    while (n > 0 && (static_cast<unsigned char>(text[n]) & 0xc0U) == 0x80U) --n;
  std::copy_n(text.begin(), n, out->begin());
  (*out)[n] = 0;
}

}  // namespace

PoseNumbers PoseNumbers::of(const Transform& T) noexcept {
  const Eigen::Quaterniond q = quaternion(T.R);
  return {{T.t.x(), T.t.y(), T.t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

Transform PoseNumbers::transform() const noexcept {
  return {Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix(), Vec3(t[0], t[1], t[2])};
}

PoseRecord PoseRecord::of(const PoseSample& sample, float decode_ms,
                          const std::optional<Transform>& T_reference_left) noexcept {
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
  r.effort = sample.effort;
  r.decode_ms = decode_ms;
  return r;
}

EarthNumbers EarthNumbers::of(const EarthPose& pose) noexcept {
  const Vec3& t = pose.T_enu_left.t;
  return {{t.x(), t.y(), t.z()}, pose.position, compass_heading_deg(pose.yaw)};
}

PoseRecord PoseRecord::of(const ComparedPose& pose, float decode_ms) noexcept {
  PoseRecord r = of(pose.pose, decode_ms,
                    pose.ins_valid ? std::optional(pose.reference.T_enu_left) : std::nullopt);
  r.placed = pose.placed;
  r.ins_valid = pose.ins_valid;
  r.compared = pose.compared;
  if (pose.placed) r.ours = EarthNumbers::of(pose.ours);
  if (pose.ins_valid) r.ins = EarthNumbers::of(pose.reference);
  // A compass counts clockwise, a yaw the other way.
  r.error = {pose.error_enu.x(), pose.error_enu.y(), pose.error_enu.z(),
             -pose.error_yaw * (180.0 / std::numbers::pi)};
  return r;
}

void EventRecord::set_sentence(std::string_view text) noexcept { copy_text(text, &sentence); }

EventRecord EventRecord::of(const EstimatorEvent& event) noexcept {
  EventRecord r;
  r.stamp = event.stamp;
  r.kind = kind_word(event.kind);
  const bool state = event.kind == EstimatorEvent::Kind::state;
  if (state) {
    std::array<char, 256> text{};
    const auto from = to_string(event.from), to = to_string(event.to);
    (void)std::snprintf(text.data(), text.size(), "%.*s to %.*s: %s", static_cast<int>(from.size()),
                        from.data(), static_cast<int>(to.size()), to.data(), event.why);
    r.set_sentence(text.data());
    // The words are string literals: views of them end with 0.
    r.fields[0] = {"from", from.data()};
    r.fields[1] = {"to", to.data()};
  } else {
    const char* begin = opening(event.kind);
    const char* why = event.kind == EstimatorEvent::Kind::calibration_accepted ? "" : event.why;
    std::array<char, 256> text{};
    if (event.kind == EstimatorEvent::Kind::calibration_contradicted && event.value > 0)
      (void)std::snprintf(text.data(), text.size(), "%s: its depths are off by %.1f %%", why,
                          event.value);
    else if (event.kind == EstimatorEvent::Kind::focal_length_contradicted)
      (void)std::snprintf(text.data(), text.size(), "%s: the drive measures %.0f px", why,
                          event.value);
    else
      (void)std::snprintf(text.data(), text.size(), "%s%s%s", begin,
                          *begin != 0 && *why != 0 ? ": " : "", why);
    r.set_sentence(text.data());
    r.fields[0] = {"value", event.value};
  }
  return r;
}

RigNumbers RigNumbers::of(const RigCalibration& rig) noexcept {
  RigNumbers n;
  n.cameras = rig.cameras;
  n.intrinsics = rig.intrinsics;
  n.sigma_noise = rig.sigma_noise;
  n.sigma_wide = rig.sigma_wide;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Transform& T = rig.T_camera_left[k];
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        n.T_camera_left[k][static_cast<std::size_t>(4 * row + column)] = T.R(row, column);
      n.T_camera_left[k][static_cast<std::size_t>(4 * row + 3)] = T.t(row);
    }
    auto next = n.covariance_wide[k].begin();
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) *next++ = rig.covariance_wide[k](i, j);
  }
  n.baseline = rig.baseline;
  n.baseline_sigma = rig.baseline_sigma;
  n.found = rig.found;
  n.frames = rig.frames;
  n.reprojection_px = rig.reprojection_px;
  n.scale_sigma = rig.scale_sigma;
  n.inflation = rig.inflation;
  n.covariance = rig.covariance;
  return n;
}

RigCalibration RigNumbers::rig() const noexcept {
  RigCalibration r;
  r.cameras = cameras;
  r.intrinsics = intrinsics;
  r.sigma_noise = sigma_noise;
  r.sigma_wide = sigma_wide;
  for (std::size_t k = 0; k < static_cast<std::size_t>(cameras); ++k) {
    const auto& T = T_camera_left[k];
    r.T_camera_left[k].R << T[0], T[1], T[2], T[4], T[5], T[6], T[8], T[9], T[10];
    r.T_camera_left[k].t << T[3], T[7], T[11];
    auto next = covariance_wide[k].begin();
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) r.covariance_wide[k](i, j) = r.covariance_wide[k](j, i) = *next++;
  }
  r.baseline = baseline;
  r.baseline_sigma = baseline_sigma;
  r.found = found;
  r.frames = frames;
  r.reprojection_px = reprojection_px;
  r.scale_sigma = scale_sigma;
  r.inflation = inflation;
  r.covariance = covariance;
  return r;
}

CalibrationRecord CalibrationRecord::of(const CalibrationDecision& d) noexcept {
  CalibrationRecord r;
  r.stamp = d.stamp;
  r.decided = true;
  r.accepted = d.accepted;
  r.cause = to_string(d.cause).data();  // a literal: ends with 0
  r.reason = d.reason;
  r.latency_frames = d.latency_frames;
  r.onset_frame = d.onset_frame;
  r.held_out_before_px = d.held_out_before_px;
  r.held_out_after_px = d.held_out_after_px;
  r.solve_ms = d.solve_ms;
  r.learnt = d.learnt;
  r.judged_depth_m = d.judged_depth_m;
  r.depth_sigma_percent = d.depth_sigma_percent;
  r.depth_difference_percent = d.depth_difference_percent;
  r.verified = d.verified;
  r.lenses = d.lenses;
  r.focal = d.focal;
  r.rig = RigNumbers::of(d.calibration);
  return r;
}

CalibrationRecord CalibrationRecord::begin(const RigCalibration& rig, Stamp stamp,
                                           const char* cause, std::string_view origin) noexcept {
  CalibrationRecord r;
  r.stamp = stamp;
  r.cause = cause;
  copy_text(origin, &r.origin);
  r.rig = RigNumbers::of(rig);
  return r;
}

}  // namespace vergence::app
