

#include "tests/support/refusal.hpp"
#include "tests/support/ros_messages.hpp"
#include "tests/system/replay/replayed_folder.hpp"

namespace vergence::test {
namespace {

TEST_F(ReplayedFolder, bagGivesThePosesOfTheSameImages) {
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
      // The bag is never finished, as after the kill of a recorder.
      bag->close_chunk();
    }
    ASSERT_EQ(pair, kFrames);
    const std::string name = "drive" + kind.ending();
    const fs::path file = work_.write(name, bag->bytes());
    const fs::path other = work_ / ("of_" + name);
    const Outcome o =
        run_vergence("replay '" + file.string() + "' --out '" + other.string() +
                     "' --calibration '" + (data() / "calibration.yaml").string() + "'");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(test::mentions(o.err, name + " is incomplete"));
    EXPECT_EQ(read_file(other / "trajectory.tum"), poses);
  }
}

}  // namespace
}  // namespace vergence::test
