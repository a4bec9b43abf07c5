#include "app/recorder/other_formats.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/recorder/session_totals.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/recorder/recorder_inputs.hpp"

namespace vergence::app {
namespace {

constexpr Geodetic kOrigin{-27.5, 153.0, 30};

/// Half a metre a frame, all ok.
SessionTotals straight_drive(std::size_t frames) {
  SessionTotals totals;
  for (std::size_t i = 0; i < frames; ++i) {
    totals.trajectory.push_back({Stamp(static_cast<std::int64_t>(i) * 50'000'000),
                                 {Mat3::Identity(), Vec3(0, 0.5 * static_cast<double>(i), 0)}});
    totals.statuses.push_back(PoseStatus::ok);
  }
  totals.read = totals.ok = frames;
  return totals;
}

/// Placed at the first frame, and anew 100 m further east at frame `anew`.
EarthFigures placed_twice(std::size_t anew) {
  EarthFigures earth;
  earth.origin = kOrigin;
  earth.placements.resize(2);
  earth.placements[1].stamp = Stamp(static_cast<std::int64_t>(anew) * 50'000'000);
  earth.placements[1].placement.T_enu_world.t = {100, 0, 0};
  return earth;
}

struct Written {
  std::vector<std::string> said, faults;
  std::string text;  // of the first file
};

Written write(const char* words, const char* file, const SessionTotals& totals,
              const EarthFigures& earth) {
  const test::TemporaryFolder folder;
  Written w;
  w.said = write_other_formats(folder.path(), parse_other_formats(words), totals, earth, &w.faults);
  if (std::filesystem::exists(folder / file)) w.text = test::read_file(folder / file);
  return w;
}

/// Metres between successive points of each line, the longest.
double longest_step(const nlohmann::json& geojson) {
  const LocalTangentPlane plane(kOrigin);
  double longest = 0;
  for (const auto& feature : geojson["features"]) {
    const auto& places = feature["geometry"]["coordinates"];
    for (std::size_t i = 1; i < places.size(); ++i) {
      const auto enu = [&plane](const nlohmann::json& p) {
        return plane.to_enu({p[1].get<double>(), p[0].get<double>(), p[2].get<double>()});
      };
      longest = std::max(longest, (enu(places[i]) - enu(places[i - 1])).norm());
    }
  }
  return longest;
}

TEST(OtherFormats, theStepToASecondPlacementIsNoWayDriven) {
  const Written w = write("geojson,kml", "drive.geojson", straight_drive(100), placed_twice(60));
  const auto geojson = nlohmann::json::parse(w.text);
  ASSERT_EQ(geojson["features"].size(), 2U);
  EXPECT_EQ(geojson["features"][0]["geometry"]["coordinates"].size(), 60U);
  EXPECT_EQ(geojson["features"][1]["geometry"]["coordinates"].size(), 40U);
  EXPECT_EQ(geojson["features"][1]["properties"]["from_stamp_ns"], 60 * 50'000'000LL);
  EXPECT_LT(longest_step(geojson), 5);
  EXPECT_TRUE(w.said.empty());
}

TEST(OtherFormats, aTrajectoryThatCouldNotBeReadBackIsAFaultAndNoDriveWithoutAPose) {
  SessionTotals totals;
  totals.read = totals.ok = 100;
  Written w = write("kitti,geojson", "trajectory.kitti", totals, placed_twice(60));
  EXPECT_TRUE(w.said.empty());
  ASSERT_EQ(w.faults.size(), 2U);
  EXPECT_NE(w.faults[0].find("trajectory.kitti is not written: trajectory.tum could not be read"),
            std::string::npos)
      << w.faults[0];
  totals.ok = 0;
  w = write("kitti", "trajectory.kitti", totals, {});
  EXPECT_TRUE(w.faults.empty());
  ASSERT_EQ(w.said.size(), 1U);
  EXPECT_NE(w.said[0].find("there never was a pose"), std::string::npos);
}

}  // namespace
}  // namespace vergence::app
