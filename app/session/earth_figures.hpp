#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/comparison/placement.hpp"
#include "core/math/se3.hpp"
#include "core/types/ins_sample.hpp"

/// Where a drive lies on the earth, and how far from the INS it is there: `earth` of summary.json.
namespace vergence::app {

/// A placement and from when on it holds.
struct PlacementRecord {
  Stamp stamp{};
  Placement placement{};
};

/// Errors against the INS after the placement, over the poses that were compared.
struct EarthErrors {
  std::uint64_t poses = 0;
  double way_m = 0;  // of the INS across the ground from its first fix on, straight across holes
  double horizontal_rms_m = 0, horizontal_most_m = 0, horizontal_end_m = 0;
  double up_rms_m = 0, up_end_m = 0;                                      // ours − INS
  double heading_rms_deg = 0, heading_most_deg = 0, heading_end_deg = 0;  // the end clockwise
};

struct EarthFigures {
  std::optional<Geodetic> origin{};  // of enu; nothing: the INS never had a fix
  std::vector<PlacementRecord> placements{};
  EarthErrors errors{};
  Transform T_ins_left{};      // the mount that the comparison took
  std::string mount_source{};  // where it is from
};

/// Null without an origin.
[[nodiscard]] nlohmann::ordered_json earth_json(const EarthFigures& figures);

}  // namespace vergence::app
