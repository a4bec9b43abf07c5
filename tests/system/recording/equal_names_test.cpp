#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/support/recording_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/run/session.hpp"
#include "tests/unit/app/commands/run_vergence.hpp"

namespace vergence {
namespace {

/// Two cameras that the configuration calls the same are two all the same.
TEST(Recorded, camerasOfOneNameAreReplayedAndExportedAsTwo) {
  const test::TemporaryFolder folder;
  const std::string session = (folder / "s").string(), again = (folder / "again").string(),
                    data = (folder / "data").string();
  const test::Outcome run = test::run_vergence(
      "run '" + std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml' --fast --duration 4 " +
      "--record poses,images,ins --out '" + session + "'" + test::kSmall +
      " --set cameras.0.name=bow --set cameras.1.name=bow");
  ASSERT_LE(run.code, 1) << run.err;
  const int frames = test::summary_of(session)["frames"]["read"];
  const auto recording = test::read_mcap(folder / "s" / "drive.mcap");
  for (const std::string topic : {"/bow/image_raw", "/bow_1/image_raw", "/bow_1/camera_info"})
    EXPECT_EQ(std::count_if(recording.messages.begin(), recording.messages.end(),
                            [&](const auto& m) { return m.topic == topic; }),
              frames)
        << topic;

  const test::Outcome replay = test::run_vergence("replay '" + session + "' --out '" + again + "'");
  EXPECT_LE(replay.code, 1) << replay.err;
  EXPECT_EQ(test::summary_of(again)["frames"]["read"], frames);
  const std::string poses = test::text_of(folder / "s" / "trajectory.tum");
  EXPECT_FALSE(poses.empty());
  EXPECT_EQ(poses, test::text_of(folder / "again" / "trajectory.tum"));

  const test::Outcome o =
      test::run_vergence("export '" + session + "' --format folder --out '" + data + "'");
  EXPECT_EQ(o.code, 0) << o.err;
  for (const char* side : {"left", "right"})
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "data" / side), {}),
              frames);
}

}  // namespace
}  // namespace vergence
