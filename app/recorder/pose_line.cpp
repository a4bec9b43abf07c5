#include "app/recorder/pose_line.hpp"

#include <iterator>

#include <fmt/format.h>

#include "app/datasets/decimal.hpp"

namespace vergence::app {
namespace {

/// east … heading_deg, a comma before each; empty where there is nothing.
void append_earth(std::string* line, bool valid, const EarthNumbers& e) {
  if (!valid) {
    *line += ",,,,,,,";
    return;
  }
  const auto out = std::back_inserter(*line);
  for (const double v : e.enu) fmt::format_to(out, ",{:.4f}", v);
  // 1e-9 degrees are a tenth of a millimetre.
  fmt::format_to(out, ",{:.9f},{:.9f},{:.4f},{:.4f}", e.position.latitude_deg,
                 e.position.longitude_deg, e.position.height_m, e.heading_deg);
}

}  // namespace

void format_pose(const PoseRecord& p, std::string* line) {
  const bool posed = p.status != PoseStatus::lost;
  line->clear();
  const auto out = std::back_inserter(*line);
  fmt::format_to(out, "{},{},{},{},{}", p.frame, p.stamp.ns(), to_string(p.state),
                 to_string(p.status), to_string(p.reason));
  if (posed) {
    for (const double v : p.world_left.t) fmt::format_to(out, ",{:.9f}", v);
    for (const double v : p.world_left.q) fmt::format_to(out, ",{:.9f}", v);
  } else {
    *line += ",,,,,,,";
  }
  append_earth(line, p.placed, p.ours);
  append_earth(line, p.ins_valid, p.ins);
  for (const double v : p.error)
    if (p.compared)
      fmt::format_to(out, ",{:.4f}", v);
    else
      *line += ',';
  fmt::format_to(out, ",{}", p.inliers);
  if (posed)
    fmt::format_to(out, ",{:.4f}", p.reprojection_px);
  else
    *line += ',';
  fmt::format_to(out, ",{:.3f}\n", p.estimate_ms);
}

void format_tum(Stamp stamp, const PoseNumbers& pose, std::string* line) {
  line->clear();
  append_seconds(line, stamp.ns());
  for (const double v : pose.t) fmt::format_to(std::back_inserter(*line), " {:.9f}", v);
  for (const double v : pose.q) fmt::format_to(std::back_inserter(*line), " {:.9f}", v);
  *line += '\n';
}

}  // namespace vergence::app
