#include "app/publish/pose_line.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

namespace vergence::app {
namespace {

/// JSON knows no infinity.
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
  return std::all_of(covariance.begin(), covariance.end(),
                     [](float c) { return std::isfinite(c); });
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

}  // namespace

EarthPose PublishedPlacement::of(const Transform& T_world_left) const {
  const Transform T_enu_left = T_enu_world * T_world_left;
  const Vec3 view = T_enu_left.R.col(2);
  return {T_enu_left, LocalTangentPlane(origin).to_geodetic(T_enu_left.t),
          std::atan2(view.y(), view.x())};
}

void write_pose_line(const PoseSample& pose, const std::optional<EarthPose>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line) {
  line->clear();
  auto out = std::back_inserter(*line);
  fmt::format_to(out, R"({{"version":1,"frame":{},"stamp_ns":{},"state":"{}","status":"{}",)",
                 pose.frame, pose.stamp.ns(), to_string(pose.state), to_string(pose.status));
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
  *line += R"(,"earth":)";
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

}  // namespace vergence::app
