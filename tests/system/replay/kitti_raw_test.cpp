#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/config/calibration_file.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "app/devices/rig_settings.hpp"
#include "app/session/ins_file.hpp"
#include "core/math/so3.hpp"
#include "tests/support/kitti_raw_writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

const std::string kRig = std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml";
constexpr double kSeconds = 9;
const std::string kForReplay =
    " --set odometry.features=300 --set calibration.online=off --set comparison.placement_m=20 "
    "--set comparison.correlation_s=60";

// A quarter of the pixels, an INS without errors; the calibration is the one given throughout.
const std::vector<std::string> kSmall{"cameras.0.size=[320, 240]",
                                      "cameras.1.size=[320, 240]",
                                      "cameras.0.intrinsics=[230, 230, 160, 120]",
                                      "cameras.1.intrinsics=[231, 231, 158, 121]",
                                      "cameras.0.distortion=[-0.08, 0.02, 0.001, -0.001, 0.004]",
                                      "cameras.1.distortion=[-0.07, 0.02, 0.001, -0.001, 0.003]",
                                      "mock.texture_detail=0",
                                      "mock.ins=ideal",
                                      "ins.rate=100",
                                      "ins.lever_arm_m=[1.1, -0.3, 0.7]",
                                      "ins.boresight_deg=[-0.8, -0.7, 0.5]",
                                      "odometry.features=300",
                                      "comparison.placement_m=20",
                                      "calibration.online=off"};

std::string set_arguments() {
  std::string text;
  for (const std::string& s : kSmall) text += " --set '" + s + "'";
  return text;
}

/// Lines of poses.csv by their column's name; every cell as it stands.
std::vector<std::map<std::string, std::string>> rows_of(const fs::path& session) {
  std::istringstream in(read_file(session / "poses.csv"));
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line + ",");
    std::map<std::string, std::string> row;
    std::size_t i = 0;
    for (std::string cell; std::getline(cells, cell, ','); ++i) {
      if (rows.empty() && names.size() == i)
        names.push_back(cell);
      else
        row[names.at(i)] = cell;
    }
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

/// One drive of the mock for all tests: live, and written as the data set.
class KittiRawReplay : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    master_ = new TemporaryFolder;
    const app::Configuration c = app::load_configuration(kRig, kSmall);
    drive_ = fs::relative(write_kitti_raw(c, kSeconds, {}, *master_ / "data"), *master_ / "data")
                 .string();
    app::CalibrationFile calibration;
    calibration.rig = app::nominal_rig(c);
    app::write_calibration(*master_ / "calibration.yaml", calibration);
  }
  static void TearDownTestSuite() { delete master_; }

  /// A copy that may be spoilt: images are links.
  fs::path copy() const {
    const fs::path to = work_ / "data";
    fs::copy(*master_ / "data", to,
             fs::copy_options::recursive | fs::copy_options::create_hard_links);
    return to;
  }
  [[nodiscard]] Outcome replay(const fs::path& data, const std::string& more = "") const {
    return run_vergence("replay '" + data.string() + "' --format kitti-raw --out '" +
                        session().string() + "'" + kForReplay + " " + more);
  }
  [[nodiscard]] fs::path session() const { return work_ / "session"; }
  [[nodiscard]] static fs::path packet(const fs::path& data, int i) {
    return data / drive_ / fmt::format("oxts/data/{:010d}.txt", i);
  }
  /// As a new file: a link shares its bytes with every other test.
  static void rewrite(const fs::path& file, const std::string& text) {
    fs::remove(file);
    std::ofstream(file, std::ios::binary) << text;
  }

  TemporaryFolder work_;
  static TemporaryFolder* master_;
  static std::string drive_;
};
TemporaryFolder* KittiRawReplay::master_ = nullptr;
std::string KittiRawReplay::drive_;

TEST_F(KittiRawReplay, aDriveReplayedFromTheDataSetsFilesIsTheDriveItselfOnTheEarthToo) {
  const Outcome run =
      run_vergence("run '" + kRig + "' --fast --duration " + std::to_string(kSeconds) +
                   set_arguments() + " --quiet --out '" + (work_ / "run").string() + "'");
  ASSERT_EQ(run.code, 0) << run.err;
  const Outcome o =
      replay(*master_ / "data", "--calibration '" + (*master_ / "calibration.yaml").string() + "'");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(read_file(work_ / "run/trajectory.tum"), read_file(session() / "trajectory.tum"));

  const auto live = rows_of(work_ / "run"), ours = rows_of(session());
  ASSERT_EQ(live.size(), ours.size());
  std::size_t compared = 0;
  for (std::size_t i = 0; i < live.size(); ++i) {
    auto mine = ours[i], theirs = live[i];
    // The last poses wait for readings: which of them come before the drive's end is the devices'
    // affair.
    if (i + 2 >= live.size()) continue;
    ASSERT_EQ(mine["error_east_m"].empty(), theirs["error_east_m"].empty()) << i;
    // Positions weigh against attitude by what the data set says of both, otherwise than by what
    // the mock says: the placement of 20 m differs by a quarter of its residual of 20 mm.
    for (const auto& [name, within] : std::map<std::string, double>{{"east", 5e-3},
                                                                    {"north", 5e-3},
                                                                    {"up", 5e-3},
                                                                    {"latitude_deg", 5e-8},
                                                                    {"ins_east", 1e-3},
                                                                    {"ins_north", 1e-3},
                                                                    {"error_north_m", 5e-3},
                                                                    {"error_heading_deg", 15e-3}}) {
      if (theirs[name].empty()) continue;
      EXPECT_NEAR(std::stod(mine[name]), std::stod(theirs[name]), within)
          << name << " of row " << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 400U);
  const auto readings = app::read_ins_file(session() / "ins.csv");
  EXPECT_NEAR(static_cast<double>(readings.size()), 100 * kSeconds, 25)
      << "the devices go on for a moment";
  EXPECT_EQ(readings[5].sample.fix, FixStatus::fix_3d);

  const auto summary = summary_of(session());
  EXPECT_EQ(summary["allocations_after_seal"], 0);
  const auto& mount = summary["earth"]["mount"];
  const std::array<double, 3> arm{1.1, -0.3, 0.7}, turn{-0.8, -0.7, 0.5};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(mount["lever_arm_m"][k].get<double>(), arm[k], 1e-6);
    EXPECT_NEAR(mount["boresight_deg"][k].get<double>(), turn[k], 1e-6);
  }
  EXPECT_LT(summary["earth"]["errors"]["horizontal_end_percent"].get<double>(), 0.8);
  EXPECT_EQ(events(session(), "placement").size(), 1U);
  EXPECT_NE(read_file(session() / "report.html").find("INS"), std::string::npos);
  EXPECT_NE(o.err.find("beside the INS after the placement"), std::string::npos) << o.err;
}

/// What is done to the drive, what the replay says and what its session holds.
struct Spoilt {
  const char* what;
  std::function<void(const fs::path& data)> spoil;
  const char* options;
  int code;
  std::vector<const char*> said;
  std::function<void(const fs::path& session)> check = [](const fs::path&) {};
};

TEST_F(KittiRawReplay, aSpoiltDriveIsComparedAsFarAsItGoes) {
  const auto status = [](int from, int to, const char* words) {
    return [=](const fs::path& data) {
      for (int i = from; i < to && fs::exists(packet(data, i)); ++i) {
        std::string text = read_file(packet(data, i));
        rewrite(packet(data, i), text.replace(text.find(" 4 9 5 5 5"), 10, words));
      }
    };
  };
  std::size_t lines = 0;
  const std::vector<Spoilt> cases{
      {"no INS",
       [](const fs::path& data) { fs::remove_all(data / drive_ / "oxts"); },
       "--frames 20",
       0,
       {"there is no INS to compare with"},
       [](const fs::path& session) { EXPECT_TRUE(summary_of(session)["earth"].is_null()); }},
      {"packets missing in the middle and without a fix",
       [&](const fs::path& data) {
         for (int i = 400; i < 460; ++i) fs::remove(packet(data, i));
         status(600, 660, " 4 2 0 0 0")(data);
       },
       "",
       0,
       {"60 packets are missing, the first is 0000000400.txt", "60 of 860 packets have no"},
       [](const fs::path& session) {
         EXPECT_EQ(events(session, "ins_gap").size(), 1U);
         EXPECT_EQ(events(session, "ins_no_fix").size(), 1U);
         EXPECT_EQ(events(session, "ins_ok").size(), 2U);
         // 0.6 s without each: at 20 Hz a dozen poses each.
         EXPECT_NEAR(summary_of(session)["comparison"]["without_ins"].get<double>(), 26, 6);
       }},
      {"no fix at all",
       status(0, 10'000, " 0 0 0 0 0"),
       "--frames 20",
       1,
       {"the INS never had a position"}},
      {"a list that is shorter and an image that is missing",
       [&](const fs::path& data) {
         const fs::path times = data / drive_ / "image_00/timestamps.txt";
         const std::string text = read_file(times);
         const std::size_t line = text.find('\n') + 1;
         lines = text.size() / line;
         rewrite(times, text.substr(0, 150 * line));  // of some 180
         fs::remove(data / drive_ / "image_01/data/0000000050.png");
       },
       "--quiet",
       0,
       {},
       [&](const fs::path& session) {
         const auto frames = summary_of(session)["frames"];
         EXPECT_EQ(frames["read"], 149);
         EXPECT_GE(frames["read"].get<std::size_t>() + frames["skipped"].get<std::size_t>(), lines);
         EXPECT_FALSE(events(session, "data").empty());
       }},
      {"no mount",
       [](const fs::path& data) {
         fs::remove(data / fs::path(drive_).parent_path() / "calib_imu_to_velo.txt");
       },
       "--frames 20",
       2,
       {"calib_imu_to_velo.txt: is missing"}},
      {"no mount but the configuration's",
       [](const fs::path& data) {
         fs::remove(data / fs::path(drive_).parent_path() / "calib_imu_to_velo.txt");
       },
       "--frames 20 --set 'ins.lever_arm_m=[1, 0, 0]'",
       0,
       {},
       [](const fs::path& session) {
         EXPECT_EQ(summary_of(session)["earth"]["mount"]["lever_arm_m"],
                   nlohmann::json({1.0, 0.0, 0.0}));
       }},
  };
  for (const Spoilt& c : cases) {
    fs::remove_all(session()), fs::remove_all(work_ / "data");
    const fs::path data = copy();
    c.spoil(data);
    const Outcome o = replay(data, c.options);
    ASSERT_EQ(o.code, c.code) << c.what << o.err;
    for (const char* part : c.said)
      EXPECT_NE(o.err.find(part), std::string::npos) << c.what << o.err;
    c.check(session());
  }
}

}  // namespace
}  // namespace vergence::test
