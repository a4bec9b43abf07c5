#include "app/evaluation/mount_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/comparison/comparison.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/math/angle.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

Json value_json(const MountValue& v, double unit) {
  return {{"value", v.observable ? Json(v.value * unit) : Json(nullptr)},
          {"sigma", v.sigma * unit}};
}

std::string row(const char* what, const MountValue& v, double unit, const char* name) {
  if (!v.observable)
    return fmt::format("  {:<34}not_observable (sigma {:.3g} {})\n", what, v.sigma * unit, name);
  return fmt::format("  {:<34}{:>11.4f} ± {:.4f} {}\n", what, v.value * unit, v.sigma * unit, name);
}

/// What `ins.boresight_deg` would be: roll, pitch, yaw. Nothing: it is no INS's mount, or a part of
/// it does not show.
std::optional<std::array<double, 3>> boresight_deg(const FoundMount& found) {
  const auto& r = found.mount.rotation;
  if (!found.of_ins ||
      !std::all_of(r.begin(), r.end(), [](const MountValue& v) { return v.observable; }))
    return std::nullopt;
  const Vec3 turn = boresight_of(found.mount.T_ref_est.R) * kDegreesPerRadian;
  return std::array{turn.x(), turn.y(), turn.z()};
}

}  // namespace

const char* mount_problem(MountStatus status) {
  switch (status) {
    case MountStatus::too_few:
      return "fewer than 20 moments in common; give a longer drive, or check that both have the "
             "same clock";
    case MountStatus::no_motion:
      return "nothing moved: a mount shows only while driving";
    case MountStatus::not_converged:
      return "no fit: the two trajectories are not of the same drive, their clocks are more than "
             "0.3 s apart, or their attitudes drift apart by more than 15 degrees";
    case MountStatus::ok:
      break;
  }
  return "";
}

std::vector<MountReference> ins_moments(std::span<const InsRecord> readings) {
  const auto placed = [](const InsRecord& r) {
    return r.sample.attitude_valid &&
           (r.sample.fix == FixStatus::fix_2d || r.sample.fix == FixStatus::fix_3d);
  };
  std::vector<MountReference> moments;
  const auto first = std::find_if(readings.begin(), readings.end(), placed);
  if (first == readings.end()) return moments;
  const LocalTangentPlane plane(first->sample.position);
  moments.reserve(readings.size());
  for (const InsRecord& r : readings) {
    if (!placed(r)) continue;
    const InsSample& s = r.sample;
    const auto& [x, y, z, w] = s.q_enu_ins;
    const Mat3 R_enu_local = plane.rotation_from(s.position);
    const Transform T_enu_ins{
        R_enu_local * Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix(),
        plane.to_enu(s.position)};
    const auto& [east, north, up] = s.velocity_enu;
    moments.push_back({s.stamp, T_enu_ins, R_enu_local * Vec3(east, north, up), s.velocity_valid});
  }
  return moments;
}

FoundMount find_ins_mount(const Trajectory& estimate, std::span<const MountReference> moments) {
  FoundMount found;
  found.of_ins = true;
  found.nominal = mount_of(Vec3::Zero(), Vec3::Zero()).R;
  found.status = estimate_mount(estimate, moments, found.nominal, {}, &found.mount);
  return found;
}

Trajectory poses_of(std::span<const MountReference> moments) {
  Trajectory poses;
  poses.reserve(moments.size());
  for (const MountReference& m : moments) poses.push_back({m.stamp, m.T_enu_ref});
  return poses;
}

FoundMount find_mount(const Trajectory& estimate, const Trajectory& reference) {
  std::vector<MountReference> readings;
  readings.reserve(reference.size());
  for (const StampedPose& pose : reference)
    readings.push_back({pose.stamp, pose.T_world_body, Vec3::Zero(), false});
  const Mat3 R_flu_camera = mount_of(Vec3::Zero(), Vec3::Zero()).R;
  FoundMount best;
  double least = 1e9;
  for (const Mat3& nominal :
       {Mat3(Mat3::Identity()), R_flu_camera, Mat3(R_flu_camera.transpose())}) {
    FoundMount found;
    found.nominal = nominal;
    found.status = estimate_mount(estimate, readings, nominal, {}, &found.mount);
    if (found.status != MountStatus::ok) {
      if (best.status != MountStatus::ok) best.status = found.status;
      continue;
    }
    const auto& r = found.mount.rotation;
    const double turn = Vec3(r[0].value, r[1].value, r[2].value).norm();
    if (turn >= least) continue;
    least = turn;
    best = found;
  }
  return best;
}

Trajectory brought_over(const Trajectory& reference, const Transform& T_ref_est) {
  Trajectory out = reference;
  for (StampedPose& pose : out) pose.T_world_body = pose.T_world_body * T_ref_est;
  return out;
}

Json mount_json(const FoundMount& found) {
  Json out;
  out["status"] = found.status == MountStatus::ok ? "ok" : mount_problem(found.status);
  if (found.status != MountStatus::ok) return out;
  const Mount& m = found.mount;
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    out["rotation_deg"][kAxes[k]] = value_json(m.rotation[k], kDegreesPerRadian);
    out["lever_arm_m"][kAxes[k]] = value_json(m.lever_arm[k], 1);
  }
  out["clock_offset_s"] = value_json(m.clock_offset, 1);
  if (const auto boresight = boresight_deg(found)) out["boresight_deg"] = *boresight;
  out["moments"] = m.moments;
  out["residual_rotation_deg"] = m.residual_rotation * kDegreesPerRadian;
  out["residual_position_m"] = m.residual_position;
  return out;
}

std::string mount_text(const FoundMount& found) {
  const Mount& m = found.mount;
  std::string out = fmt::format(
      "mount of the {}, from {} moments (residuals {:.3f} deg, {:.3f} m)\n",
      found.of_ins ? "left camera in the INS's body" : "estimate's body in the reference's",
      m.moments, m.residual_rotation * kDegreesPerRadian, m.residual_position);
  out += row("turn about the reference's x", m.rotation[0], kDegreesPerRadian, "deg");
  out += row("turn about its y", m.rotation[1], kDegreesPerRadian, "deg");
  out += row("turn about its z", m.rotation[2], kDegreesPerRadian, "deg");
  out += row("lever arm along x", m.lever_arm[0], 1, "m");
  out += row("lever arm along y", m.lever_arm[1], 1, "m");
  out += row("lever arm along z", m.lever_arm[2], 1, "m");
  out += row("reference's stamps are late by", m.clock_offset, 1e3, "ms (reported, not applied)");
  if (const auto b = boresight_deg(found))
    out +=
        fmt::format("  as the configuration has it: ins.boresight_deg: [{:.2f}, {:.2f}, {:.2f}]\n",
                    (*b)[0], (*b)[1], (*b)[2]);
  return out + "\n";
}

}  // namespace vergence::app
