#include "app/publish/pose_stream.hpp"

#include <cmath>
#include <iterator>
#include <limits>

#include <nlohmann/json.hpp>

#include "app/runtime/transform_rows.hpp"
#include "core/calibration/health.hpp"

namespace vergence::app {

EnuPose PublishedEnuAlignment::of(const Transform& T_world_left) const {
  const Transform T_enu_left = alignment.T_enu_world * T_world_left;
  const Vec3 view = T_enu_left.R.col(2);
  return {T_enu_left, LocalTangentPlane(origin).to_geodetic(T_enu_left.t),
          std::atan2(view.y(), view.x())};
}

const char* pairing_name(Pairing pairing) noexcept {
  constexpr std::array kNames{"assumed", "verified", "contradicted"};
  return kNames[static_cast<std::size_t>(pairing)];
}

namespace {

/// JSON has no infinity.
void write_number(double value, int digits, std::string* line) {
  if (std::isfinite(value))
    fmt::format_to(std::back_inserter(*line), "{:.{}f}", value, digits);
  else
    *line += "null";
}

void write_covariance(const char* key, const Covariance6& covariance, std::string* line) {
  fmt::format_to(std::back_inserter(*line), R"(,"{}":[{:.4g})", key, covariance[0]);
  for (std::size_t i = 1; i < covariance.size(); ++i)
    fmt::format_to(std::back_inserter(*line), ",{:.4g}", covariance[i]);
  *line += ']';
}

bool finite(const Covariance6& covariance) {
  return std::ranges::all_of(covariance, [](float c) { return std::isfinite(c); });
}

void write_covariances(const PoseSample& pose, std::string* line) {
  if (pose.status == PoseStatus::lost || !finite(pose.covariance) ||
      !finite(pose.motion_covariance) || !std::isfinite(pose.length_sigma)) {
    *line += R"(,"covariance":null,"motion_covariance":null,"length_sigma":null)";
    return;
  }
  write_covariance("covariance", pose.covariance, line);
  write_covariance("motion_covariance", pose.motion_covariance, line);
  fmt::format_to(std::back_inserter(*line), R"(,"length_sigma":{:.5f})", pose.length_sigma);
}

using nlohmann::json;

/// A line of its type with `fields`. Names may contain invalid UTF-8.
std::string format_line(const char* type, const json& fields) {
  json line{{"version", kPoseStreamVersion}, {"type", type}};
  line.update(fields);
  return line.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

json numbers(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

const char* fix_name(FixStatus fix) noexcept {
  constexpr std::array kNames{"none", "dead_reckoning", "2d", "3d"};
  return kNames[static_cast<std::size_t>(fix)];
}

}  // namespace

void write_pose_line(const PoseSample& pose, const std::optional<EnuPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line) {
  line->clear();
  auto out = std::back_inserter(*line);
  fmt::format_to(
      out, R"({{"version":{},"type":"pose","frame":{},"stamp_ns":{},"state":"{}","status":"{}",)",
      kPoseStreamVersion, pose.frame, pose.stamp.ns(), to_string(pose.state),
      to_string(pose.status));
  fmt::format_to(out, R"("reason":"{}","pose":)", to_string(pose.reason));
  if (pose.status == PoseStatus::lost || !pose.T_world_left.R.allFinite() ||
      !pose.T_world_left.t.allFinite()) {
    *line += "null";
  } else {
    const Vec3& t = pose.T_world_left.t;
    const Eigen::Quaterniond q = quaternion(pose.T_world_left.R);
    fmt::format_to(
        out,
        R"({{"position_m":[{:.6f},{:.6f},{:.6f}],"orientation_xyzw":[{:.9f},{:.9f},{:.9f},{:.9f}]}})",
        t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  write_covariances(pose, line);
  *line += R"(,"enu":)";
  if (pose.status == PoseStatus::lost || !earth) {
    *line += "null";
  } else {
    fmt::format_to(out, R"({{"enu_m":[{:.4f},{:.4f},{:.4f}],"latitude_deg":{:.9f},)",
                   earth->T_enu_left.t.x(), earth->T_enu_left.t.y(), earth->T_enu_left.t.z(),
                   earth->position.latitude_deg);
    fmt::format_to(out, R"("longitude_deg":{:.9f},"height_m":{:.4f},"heading_deg":{:.4f}}})",
                   earth->position.longitude_deg, earth->position.height_m,
                   compass_heading_deg(earth->yaw));
  }
  fmt::format_to(out, R"(,"inliers":{},"stereo_inliers":{},"reprojection_px":)", pose.inliers,
                 pose.stereo_inliers);
  write_number(pose.reprojection_px, 4, line);
  *line += R"(,"estimate_ms":)";
  write_number(static_cast<double>(pose.estimate_ms), 3, line);
  *line += R"(,"age_ms":)";
  write_number(age_ms.value_or(std::numeric_limits<double>::quiet_NaN()), 3, line);
  fmt::format_to(out, ",\"dropped\":{}}}\n", dropped);
}

std::string calibration_line(const CalibrationRecord& record, std::span<const std::string> names,
                             const calibration::CalibrationOptions& options) {
  const RigCalibration& rig = record.calibration;
  json cameras = json::array();
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& lens = rig.intrinsics[k];
    const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
    cameras.push_back({{"name", k < names.size() ? names[k] : fmt::format("camera{}", k)},
                       {"size", {lens.width, lens.height}},
                       {"model", radtan ? "pinhole-radtan" : "pinhole-equidistant"},
                       {"intrinsics", {lens.fx, lens.fy, lens.cx, lens.cy}},
                       {"distortion", lens.distortion},
                       {"T_camera_left", rows_of(rig.T_camera_left[k])}});
  }
  // In m: depth at which rating() evaluates the rig.
  constexpr double kDepth = 20;
  const bool known = calibration::depth_error_percent(rig, kDepth) > 0;
  return format_line("calibration",
                     {{"stamp_ns", record.stamp.ns()},
                      {"cause", record.cause_name()},
                      {"rating", known ? json(calibration::rating(rig, options)) : json()},
                      {"cameras", cameras}});
}

std::string alignment_line(const PublishedEnuAlignment& p) {
  return format_line("alignment", {{"stamp_ns", p.alignment.last.ns()},
                                   {"origin",
                                    {{"latitude_deg", p.origin.latitude_deg},
                                     {"longitude_deg", p.origin.longitude_deg},
                                     {"height_m", p.origin.height_m}}},
                                   {"T_enu_world", rows_of(p.alignment.T_enu_world)},
                                   {"position_sigma_m", numbers(p.alignment.position_sigma)},
                                   {"rotation_sigma_rad", numbers(p.alignment.rotation_sigma)}});
}

std::string status_line(const StreamStatus& s) {
  json fields{{"session", s.session},       {"stamp_ns", nullptr},    {"state", nullptr},
              {"status", nullptr},          {"reason", nullptr},      {"silent_s", nullptr},
              {"frames", nullptr},          {"pairing", nullptr},     {"cameras", json::array()},
              {"calibrated", s.calibrated}, {"verified", s.verified}, {"ins", nullptr}};
  if (s.frame) {
    const FrameReport& f = *s.frame;
    const FrameCounts& n = f.counts;
    fields["stamp_ns"] = f.pose.stamp.ns();
    fields["state"] = to_string(f.pose.state);
    fields["status"] = to_string(f.pose.status);
    fields["reason"] = to_string(f.pose.reason);
    fields["silent_s"] = s.silent_s;
    fields["frames"] = {{"read", n.read}, {"ok", n.ok},           {"degraded", n.degraded},
                        {"lost", n.lost}, {"missing", n.missing}, {"dropped", s.dropped}};
    fields["pairing"] = pairing_name(f.pairing);
    for (int k = 0; k < f.cameras; ++k)
      fields["cameras"].push_back((f.images_present >> k & 1U) != 0);
  }
  if (s.ins)
    fields["ins"] = {
        {"fix", fix_name(s.ins->fix)}, {"silent_s", s.ins->silent_s}, {"aligned", s.aligned}};
  return format_line("status", fields);
}

std::string image_line(std::uint64_t frame, Stamp stamp, int camera, std::string_view name,
                       const ImageView& image) {
  return format_line("image", {{"frame", frame},
                               {"stamp_ns", stamp.ns()},
                               {"camera", camera},
                               {"name", name},
                               {"width", image.width},
                               {"height", image.height},
                               {"bytes", std::int64_t{image.width} * image.height}});
}

std::string response_line(std::string_view request, bool accepted, std::string_view message) {
  return format_line("response",
                     {{"request", request}, {"accepted", accepted}, {"message", message}});
}

}  // namespace vergence::app
