#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/support/ros_messages.hpp"
#include "tests/system/replay/replayed_folder.hpp"

namespace vergence::test {
namespace {

TEST_F(ReplayedFolder, aBagGivesThePosesOfTheSameImages) {
  ASSERT_EQ(replay().code, 0);
  const std::string poses = read_file(session() / "trajectory.tum");
  for (const BagKind& kind : {BagKind{"mcap", "zstd"}, BagKind{"rosbag", "bz2"}}) {
    const auto bag = kind.writer();
    bag->channel(1, "/left/image_raw/compressed", "sensor_msgs/CompressedImage");
    bag->channel(2, "/right/image_raw/compressed", "sensor_msgs/CompressedImage");
    std::ifstream times(data() / "times.txt");
    std::size_t pair = 0;
    for (std::int64_t ns = 0; times >> ns; ++pair) {
      for (int k = 0; k < 2; ++k)
        bag->message(
            static_cast<std::uint16_t>(k + 1), ns,
            compressed_message(kind.wire(), ns, "png", read_file(data() / image_name(k, pair))));
      bag->close_chunk();  // never finished: as a recorder that was killed leaves it
    }
    ASSERT_EQ(pair, kFrames);
    const std::string name = "drive" + kind.ending();
    const fs::path file = work_.write(name, bag->bytes());
    const fs::path other = work_ / ("of_" + name);
    const Outcome o =
        run_vergence("replay '" + file.string() + "' --out '" + other.string() +
                     "' --calibration '" + (data() / "calibration.yaml").string() + "'");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find(name + " is unfinished"), std::string::npos) << o.err;
    EXPECT_EQ(read_file(other / "trajectory.tum"), poses);
  }
}

// The INS of a bag goes through the same comparison as any other: readings in ins.csv, poses with
// errors, a pause where the receiver has no fix.
TEST_F(ReplayedFolder, aBagWithAnInsIsCompared) {
  for (const BagKind& kind : {BagKind{"mcap", "lz4"}, BagKind{"rosbag", "lz4"}}) {
    const auto bag = kind.writer();
    bag->channel(1, "/left/image_raw/compressed", "sensor_msgs/CompressedImage");
    bag->channel(2, "/right/image_raw/compressed", "sensor_msgs/CompressedImage");
    bag->channel(3, "/fix", "sensor_msgs/NavSatFix");
    bag->channel(4, "/imu", "sensor_msgs/Imu");
    std::ifstream times(data() / "times.txt");
    std::size_t pair = 0;
    for (std::int64_t ns = 0; times >> ns; ++pair) {
      for (int k = 0; k < 2; ++k)
        bag->message(
            static_cast<std::uint16_t>(k + 1), ns,
            compressed_message(kind.wire(), ns, "png", read_file(data() / image_name(k, pair))));
      // North along a meridian, 110.6 km a degree there: half a metre a frame.
      const bool pause = pair >= 12 && pair < 18;
      bag->message(3, ns,
                   fix_message(kind.wire(), ns,
                               {static_cast<std::int8_t>(pause ? -1 : 0),
                                0.5 / 110'600 * static_cast<double>(pair), 153, 40, 0.01}));
      bag->message(4, ns,
                   imu_message(kind.wire(), ns, {0, 0, std::sqrt(0.5), std::sqrt(0.5)}, 1e-6));
    }
    bag->finish();
    const fs::path file = work_.write("ins" + kind.ending(), bag->bytes());
    const fs::path out = work_ / ("of_" + std::string(kind.container));
    const Outcome o = run_vergence("replay '" + file.string() + "' --out '" + out.string() +
                                   "' --calibration '" + (data() / "calibration.yaml").string() +
                                   "' --ins-topic /fix --set ins.lever_arm_m=[1,0,0.5]");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("the INS is /fix with the orientation of /imu"), std::string::npos)
        << o.err;
    EXPECT_NE(o.err.find("6 of 24 readings have no fix"), std::string::npos) << o.err;
    EXPECT_NE(o.err.find("[1.000, 0.000, 0.500] m in the INS's body"), std::string::npos) << o.err;
    EXPECT_NE(
        read_file(out / "events.jsonl").find("the INS had no position: the comparison pauses"),
        std::string::npos);
    const std::string readings = read_file(out / "ins.csv");
    EXPECT_EQ(std::count(readings.begin(), readings.end(), '\n'), 1 + static_cast<int>(kFrames));
    const std::string no = "' --out '" + (work_ / "no").string() + "' ";
    Outcome refused = run_vergence("replay '" + file.string() + no + "--ins-topic /imu");
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_NE(refused.err.find("of NavSatFix are /fix"), std::string::npos) << refused.err;
    refused = run_vergence("calibrate --drive '" + file.string() + no + "--left-topic /nowhere");
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_NE(refused.err.find("has no image on /nowhere"), std::string::npos) << refused.err;
    refused = run_vergence("calibrate --drive '" + data().string() + no + "--right-topic /right");
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_NE(refused.err.find("topics are chosen of bags"), std::string::npos) << refused.err;
    refused = run_vergence("calibrate --drive '" + file.string() + no + "--calibration '" +
                           (data() / "calibration.yaml").string() +
                           "' --left-topic /left/image_raw/compressed "
                           "--right-topic /right/image_raw/compressed --quiet");
    EXPECT_EQ(refused.code, 1) << refused.err;
    EXPECT_NE(refused.err.find("no calibration was found"), std::string::npos)
        << "24 frames are too few: " << refused.err;
  }
}

}  // namespace
}  // namespace vergence::test
