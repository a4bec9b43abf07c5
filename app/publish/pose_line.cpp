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

bool finite(const PoseNumbers& pose) {
  double sum = 0;
  for (const double v : pose.t) sum += v;
  for (const double v : pose.q) sum += v;
  return std::isfinite(sum);
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

void write_covariances(const PublishedPose& pose, std::string* line) {
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

PublishedPose PublishedPose::of(const PoseSample& sample, HostStamp out) noexcept {
  PublishedPose p;
  p.frame = sample.frame;
  p.stamp = sample.stamp;
  p.out = out;
  p.state = sample.state;
  p.status = sample.status;
  p.reason = sample.reason;
  p.world_left = PoseNumbers::of(sample.T_world_left);
  p.covariance = sample.covariance;
  p.motion_covariance = sample.motion_covariance;
  p.length_sigma = sample.length_sigma;
  p.inliers = sample.inliers;
  p.stereo_inliers = sample.stereo_inliers;
  p.reprojection_px = sample.reprojection_px;
  p.estimate_ms = sample.estimate_ms;
  return p;
}

EarthNumbers Earth::of(const PoseNumbers& world_left) const {
  const Transform T_enu_left = T_enu_world_ * world_left.transform();
  const Vec3 view = T_enu_left.R.col(2);
  return EarthNumbers::of(
      {T_enu_left, plane_.to_geodetic(T_enu_left.t), std::atan2(view.y(), view.x())});
}

void write_pose_line(const PublishedPose& pose, const std::optional<EarthNumbers>& earth,
                     std::optional<double> age_ms, std::uint64_t dropped, std::string* line) {
  line->clear();
  auto out = std::back_inserter(*line);
  fmt::format_to(out, R"({{"version":1,"frame":{},"stamp_ns":{},"state":"{}","status":"{}",)",
                 pose.frame, pose.stamp.ns(), to_string(pose.state), to_string(pose.status));
  fmt::format_to(out, R"("reason":"{}","pose":)", to_string(pose.reason));
  if (pose.status == PoseStatus::lost || !finite(pose.world_left)) {
    *line += "null";
  } else {
    const auto& [t, q] = pose.world_left;
    fmt::format_to(
        out,
        R"({{"position_m":[{:.6f},{:.6f},{:.6f}],"orientation_xyzw":[{:.9f},{:.9f},{:.9f},{:.9f}]}})",
        t[0], t[1], t[2], q[0], q[1], q[2], q[3]);
  }
  write_covariances(pose, line);
  *line += R"(,"earth":)";
  if (pose.status == PoseStatus::lost || !earth) {
    *line += "null";
  } else {
    fmt::format_to(out, R"({{"enu_m":[{:.4f},{:.4f},{:.4f}],"latitude_deg":{:.9f},)", earth->enu[0],
                   earth->enu[1], earth->enu[2], earth->position.latitude_deg);
    fmt::format_to(out, R"("longitude_deg":{:.9f},"height_m":{:.4f},"heading_deg":{:.4f}}})",
                   earth->position.longitude_deg, earth->position.height_m, earth->heading_deg);
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
