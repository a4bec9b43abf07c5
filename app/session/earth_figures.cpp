#include "app/session/earth_figures.hpp"

#include <nlohmann/json.hpp>

#include "core/comparison/comparison.hpp"
#include "core/math/angle.hpp"

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

Json placement_json(const PlacementRecord& record) {
  const Placement& p = record.placement;
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rows.push_back(p.T_enu_world.R(row, column));
    rows.push_back(p.T_enu_world.t(row));
  }
  return {{"stamp_ns", record.stamp.ns()},
          {"T_enu_world", rows},
          {"fitted_over_m", p.distance},
          {"residual_m", p.residual},
          {"heading_sigma_deg", p.rotation_sigma.z() * kDegreesPerRadian}};
}

Json errors_json(const EarthErrors& e) {
  if (e.poses == 0) return nullptr;
  return {
      {"poses", e.poses},
      {"horizontal_rms_m", e.horizontal_rms_m},
      {"horizontal_max_m", e.horizontal_most_m},
      {"horizontal_end_m", e.horizontal_end_m},
      {"horizontal_end_percent", e.way_m > 0 ? Json(100 * e.horizontal_end_m / e.way_m) : Json()},
      {"up_rms_m", e.up_rms_m},
      {"up_end_m", e.up_end_m},
      {"heading_rms_deg", e.heading_rms_deg},
      {"heading_max_deg", e.heading_most_deg},
      {"heading_end_deg", e.heading_end_deg}};
}

}  // namespace

Json earth_json(const EarthFigures& figures) {
  if (!figures.origin) return nullptr;
  const Vec3 turn = boresight_of(figures.T_ins_left.R) * kDegreesPerRadian;
  const Vec3& arm = figures.T_ins_left.t;
  Json placements = Json::array();
  for (const PlacementRecord& record : figures.placements)
    placements.push_back(placement_json(record));
  return {{"origin",
           {{"latitude_deg", figures.origin->latitude_deg},
            {"longitude_deg", figures.origin->longitude_deg},
            {"height_m", figures.origin->height_m}}},
          {"mount",
           {{"lever_arm_m", {arm.x(), arm.y(), arm.z()}},
            {"boresight_deg", {turn.x(), turn.y(), turn.z()}},
            {"source", figures.mount_source}}},
          {"placements", placements},
          {"way_m", figures.errors.way_m},
          {"errors", errors_json(figures.errors)}};
}

}  // namespace vergence::app
