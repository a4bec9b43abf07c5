// Bags with everything that is read, changed at random.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "app/datasets/recorded_ins.hpp"
#include "core/math/random.hpp"
#include "tests/support/bag_in_memory.hpp"
#include "tests/support/mutated.hpp"
#include "tests/support/ros_messages.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace vergence::app {
namespace {

using test::BagKind;

constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kStep = 50'000'000;  // ns

std::vector<std::uint8_t> example(const BagKind& kind) {
  constexpr std::uint32_t kSide = 16;  // px
  const auto wire = kind.wire();
  const auto writer = kind.writer();
  writer->channel(0, "/left/image_raw", "sensor_msgs/Image");
  writer->channel(1, "/right/image_raw/compressed", "sensor_msgs/CompressedImage");
  writer->channel(2, "/left/camera_info", "sensor_msgs/CameraInfo");
  writer->channel(3, "/right/camera_info", "sensor_msgs/CameraInfo");
  writer->channel(4, "/fix", "sensor_msgs/NavSatFix");
  writer->channel(5, "/imu", "sensor_msgs/Imu");
  writer->channel(6, "/odom", "nav_msgs/Odometry");
  for (const std::uint16_t k : std::vector<std::uint16_t>{2, 3})
    writer->message(
        k, kStart,
        camera_info_message(
            wire, kStart,
            {kSide, kSide, "plumb_bob", {0.1, 0, 0, 0, 0}, 16, 16, 8, 8, k == 3 ? -8.0 : 0.0}));
  std::vector<std::uint8_t> png;
  (void)cv::imencode(".png", cv::Mat(kSide, kSide, CV_8U, cv::Scalar(90)), png);
  for (std::int64_t i = 0; i < 3; ++i) {
    const std::int64_t ns = kStart + i * kStep;
    writer->message(0, ns,
                    image_message(wire, ns,
                                  {kSide, kSide, 3 * kSide, "rgb8",
                                   std::string(std::size_t{3} * kSide * kSide, 'x')}));
    writer->message(1, ns,
                    compressed_message(wire, ns, "png", std::string(png.begin(), png.end())));
    writer->message(4, ns, fix_message(wire, ns, {0, -27.5, 153, 40, 1}));
    writer->message(5, ns, imu_message(wire, ns, {0, 0, 0, 1}, 1e-4));
    writer->message(
        6, ns,
        odometry_message(wire, ns,
                         {{0.5 * static_cast<double>(i), 0, 0}, {0, 0, 0, 1}, {10, 0, 0}, 1}));
    if (i == 1) writer->close_chunk();
  }
  writer->finish();
  return {writer->bytes().begin(), writer->bytes().end()};
}

TEST(Bag, thirtyThousandMutationsAreReadOrRefused) {
  std::vector<std::vector<std::uint8_t>> examples;
  // Most without compression: of packed chunks nearly all changes fail their check.
  for (const BagKind& kind :
       {BagKind{"mcap", ""}, BagKind{"rosbag", "none"}, BagKind{"mcap", ""},
        BagKind{"rosbag", "none"}, BagKind{"mcap", "zstd"}, BagKind{"rosbag", "lz4"},
        BagKind{"mcap", "lz4"}, BagKind{"rosbag", "bz2"}}) {
    examples.push_back(example(kind));
    const std::string whole(examples.back().begin(), examples.back().end());
    const StereoSequence s = test::bag_in_memory(kind.is_mcap(), whole, false);
    ASSERT_EQ(s.pairs.size(), 3U) << "the example itself is read";
    ASSERT_EQ(s.ins->readings.size(), 3U);
  }
  Random random(22);
  for (std::size_t i = 0; i < 30'000; ++i) {
    const auto bag = test::mutated(examples[i % examples.size()], &random);
    (void)LLVMFuzzerTestOneInput(bag.data(), bag.size());
  }
}

}  // namespace
}  // namespace vergence::app
