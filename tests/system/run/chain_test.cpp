// Drives by numbered pulses with the built program: what proves the pairs, what a session says of
// time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

using test::events;
using test::kSmall;
using test::Outcome;
using test::run_vergence;
using test::summary_of;
using test::TemporaryFolder;
using test::text_of;

Outcome drive(const std::string& configuration, const std::filesystem::path& session,
              const std::string& more) {
  return run_vergence("run '" + std::string(VERGENCE_SOURCE_DIR) + "/app/config/" + configuration +
                      "' --fast --out '" + session.string() + "' " + more + kSmall + " --quiet");
}

/// Every pose's stamp is a true mid-exposure to that many microseconds; from the first second on.
void expect_true_stamps(const std::filesystem::path& session, double most_us) {
  const app::Trajectory poses = app::read_tum(session / "trajectory.tum"),
                        truth = app::read_tum(session / "truth.tum");
  ASSERT_GT(poses.size(), 60U);
  for (const StampedPose& pose : poses) {
    const auto after = std::lower_bound(truth.begin(), truth.end(), pose.stamp,
                                        [](const StampedPose& p, Stamp s) { return p.stamp < s; });
    double nearest = 1e9;
    if (after != truth.end())
      nearest = std::min(nearest, std::abs((after->stamp - pose.stamp).to_seconds()) * 1e6);
    if (after != truth.begin())
      nearest =
          std::min(nearest, std::abs((std::prev(after)->stamp - pose.stamp).to_seconds()) * 1e6);
    EXPECT_LE(nearest, most_us) << pose.stamp.ns();
  }
}

TEST(Chain, boardAndInsAsBytesOnLinesGiveProvenPairsAndTheSameBytesOnEveryRunWhateverGoes) {
  const TemporaryFolder folder;
  // Long enough after the last fault for the drive to confirm its calibration again.
  const std::string faults =
      "--duration 12 --fault board_reboot@3 --fault 'camera_gone@6 camera=1 duration_s=0.5'";
  const Outcome o = drive("mock_chain.yaml", folder / "a", faults + " --threads 2");
  ASSERT_EQ(o.code, 0) << o.err;
  ASSERT_EQ(drive("mock_chain.yaml", folder / "b", faults + " --threads 1").code, 0);
  for (const char* name : {"trajectory.tum", "truth.tum", "events.jsonl"})
    EXPECT_EQ(text_of(folder / "a" / name), text_of(folder / "b" / name)) << name;

  const auto summary = summary_of(folder / "a");
  const auto& pairing = summary["time"]["pairing"];
  EXPECT_EQ(pairing["mode"], "board");
  EXPECT_EQ(pairing["proven"], true);
  EXPECT_LE(pairing["worst_acquisition_s"].get<double>(), 1);
  EXPECT_EQ(pairing["sets"]["unproven"], 0);
  EXPECT_EQ(pairing["cameras"][0]["acquisitions"], 2);
  EXPECT_EQ(pairing["cameras"][1]["acquisitions"], 3);
  EXPECT_EQ(summary["time"]["board"]["reboots"], 1);
  EXPECT_EQ(summary["allocations_after_seal"], 0);
  EXPECT_EQ(events(folder / "a", "board_rebooted").size(), 1U);
  EXPECT_EQ(events(folder / "a", "pairing_proven").size(), 5U);
  bool asked = false;
  for (const auto& clock : summary["time"]["clocks"])
    asked = asked || (clock.contains("pings") && clock["pings"]["answered"] > 300);
  EXPECT_TRUE(asked) << summary["time"]["clocks"];
  // The INS's first readings carry UTC: the virtual host's is 2020's, the simulated INS's is its
  // own.
  expect_true_stamps(folder / "a", 1000);
}

TEST(Chain, feedbackLinesGiveTheMeasuredMiddle) {
  const TemporaryFolder folder;
  const Outcome o = drive("mock_board.yaml", folder / "s", "--duration 6");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(summary_of(folder / "s")["time"]["pairing"]["proven"], true);
  expect_true_stamps(folder / "s", 50);
}

TEST(Chain, whereNothingProvesThePairsTheSessionSaysSoEverywhere) {
  const TemporaryFolder folder;
  const Outcome o = drive("mock.yaml", folder / "s", "--duration 3");
  ASSERT_EQ(o.code, 0) << o.err;
  const auto pairing = summary_of(folder / "s")["time"]["pairing"];
  EXPECT_EQ(pairing["can_be_proven"], false);
  EXPECT_EQ(pairing["proven"], false);
  EXPECT_NE(text_of(folder / "s" / "events.jsonl")
                .find("nothing proves that paired images were exposed together"),
            std::string::npos);
  EXPECT_NE(text_of(folder / "s" / "report.html")
                .find("Nothing proves that paired images were exposed together"),
            std::string::npos);
}

}  // namespace
}  // namespace vergence
