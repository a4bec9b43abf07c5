#include <gtest/gtest.h>

#include <array>

#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/errors.hpp"
#include "tests/support/mcap_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using test::CdrWriter;
using test::McapWriter;

constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kStep = 50'000'000;  // ns
constexpr std::uint32_t kWidth = 70, kHeight = 48, kStride = 80;                // px, px, bytes

char pixel(std::uint32_t x, std::uint32_t y) { return static_cast<char>((3 * x + 5 * y) & 0xFFU); }

std::string image(std::int64_t stamp, bool little = true, std::uint32_t width = kWidth) {
  std::string data(std::size_t{kStride} * kHeight, '\0');
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < width; ++x) data[y * kStride + x] = pixel(x, y);
  return CdrWriter(little)
      .header(stamp)
      .put(kHeight)
      .put(width)
      .text("mono8")
      .put(std::uint8_t{0})
      .put(kStride)
      .blob(data)
      .bytes();
}

/// Of a rectified pair 0.12 m apart, fx = fy = 60.
std::string camera_info(double fx_times_b, const std::string& model = "plumb_bob") {
  CdrWriter w;
  w.header(kStart).put(kHeight).put(kWidth).text(model).put(std::uint32_t{5});
  for (const double d : {-0.1, 0.01, 0.001, 0.002, 0.0}) w.put(d);
  for (const double k : {60.0, 0.0, 35.0, 0.0, 61.0, 24.0, 0.0, 0.0, 1.0}) w.put(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) w.put(r);
  for (const double p : {60.0, 0.0, 35.0, fx_times_b, 0.0, 60.0, 24.0, 0.0, 0.0, 0.0, 1.0, 0.0})
    w.put(p);
  return w.bytes();
}

class Bag : public ::testing::Test {
 protected:
  Bag() {
    writer_.channel(1, "/left/image_raw", "sensor_msgs/msg/Image");
    writer_.channel(2, "/right/image_raw", "sensor_msgs/msg/Image");
    writer_.channel(3, "/left/camera_info", "sensor_msgs/msg/CameraInfo");
    writer_.channel(4, "/right/camera_info", "sensor_msgs/msg/CameraInfo");
    writer_.message(3, kStart, camera_info(0));
    writer_.message(4, kStart, camera_info(-7.2));
  }
  void frame(std::int64_t i, std::int64_t late = 0) {
    writer_.message(1, kStart, image(kStart + i * kStep));
    writer_.message(2, kStart, image(kStart + i * kStep + late, false));
  }
  [[nodiscard]] StereoSequence open(const BagTopics& topics = {}) {
    writer_.finish();
    folder_.write("drive/drive_0.mcap", writer_.bytes());
    return open_sequence(SequenceFormat::mcap, folder_ / "drive", std::nullopt, {}, {0, 1}, topics);
  }
  [[nodiscard]] std::string refusal(const BagTopics& topics = {}) {
    try {
      (void)open(topics);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }

  test::TemporaryFolder folder_;
  McapWriter writer_{"lz4"};
};

TEST_F(Bag, PairsCalibrationAndPixelsAreThoseOfTheMessages) {
  for (std::int64_t i = 0; i < 4; ++i) frame(i, 1'000'000);
  const StereoSequence s = open();
  EXPECT_EQ(find_format(folder_ / "drive"), SequenceFormat::mcap);
  ASSERT_EQ(s.pairs.size(), 4U);
  EXPECT_EQ(s.left_out, 0U);
  EXPECT_EQ(s.pairs[2].stamp.ns(), kStart + 2 * kStep);
  EXPECT_EQ(s.calibration.intrinsics[1].fy, 61);
  EXPECT_EQ(s.calibration.intrinsics[0].distortion[0], -0.1);
  EXPECT_NEAR((s.calibration.T_camera_left[1].t - Vec3(-0.12, 0, 0)).norm(), 0, 1e-15);
  std::vector<std::uint8_t> out(std::size_t{kWidth} * kHeight), work;
  for (const std::string& name : s.pairs[3].file) {
    ASSERT_EQ(s.store->decode(name, {kWidth, kHeight}, out.data(), kWidth, &work),
              ImageFileStatus::ok)
        << name;
    for (std::uint32_t y = 0; y < kHeight; ++y)
      for (std::uint32_t x = 0; x < kWidth; ++x)
        ASSERT_EQ(out[y * kWidth + x], static_cast<std::uint8_t>(pixel(x, y)));
  }
  EXPECT_EQ(s.store->decode("left/image_raw#4", {kWidth, kHeight}, out.data(), kWidth, &work),
            ImageFileStatus::missing);
}

TEST_F(Bag, ImagesOfAnotherSizeOrGoingBackAreLeftOutAndCounted) {
  for (std::int64_t i = 0; i < 4; ++i) frame(i);
  writer_.message(1, 0, image(kStart + 4 * kStep, true, kWidth - 2));
  writer_.message(1, 0, image(kStart + kStep));
  writer_.message(1, 0, image(kStart + 5 * kStep).substr(0, 300));
  const StereoSequence s = open();
  EXPECT_EQ(s.pairs.size(), 4U);
  EXPECT_EQ(s.left_out, 3U);
  ASSERT_EQ(s.remarks.size(), 1U);
  EXPECT_NE(s.remarks[0].find("1 images that cannot be read, 1 of another size than the first and "
                              "1 whose stamps do not go forward"),
            std::string::npos)
      << s.remarks[0];
  EXPECT_NE(s.remarks[0].find("drive_0.mcap, offset "), std::string::npos) << s.remarks[0];
}

TEST_F(Bag, ImageWithoutPartnerIsLeftOut) {
  for (std::int64_t i = 0; i < 4; ++i) frame(i);
  writer_.message(1, 0, image(kStart + 4 * kStep));
  frame(5);
  const StereoSequence s = open();
  EXPECT_EQ(s.pairs.size(), 5U);
  EXPECT_EQ(s.left_out, 1U);
}

TEST_F(Bag, StampsThatNeverMatchAreRefused) {
  for (std::int64_t i = 0; i < 4; ++i) frame(i, 3'600'000'000'000);
  EXPECT_NE(refusal().find("has no pair"), std::string::npos);
}

TEST_F(Bag, SeveralTopicsAreListedAndOneIsChosen) {
  writer_.channel(5, "/left/image_small", "sensor_msgs/msg/Image");
  writer_.message(5, 0, image(kStart));
  for (std::int64_t i = 0; i < 4; ++i) frame(i);
  const std::string said = refusal();
  EXPECT_NE(said.find("--left-topic"), std::string::npos) << said;
  EXPECT_NE(said.find("/left/image_raw (4 images), /left/image_small (1 images)"),
            std::string::npos)
      << said;
  EXPECT_EQ(open({"/left/image_raw", ""}).pairs.size(), 4U);
}

TEST_F(Bag, CameraInfoOfAnotherModelIsRefused) {
  writer_ = McapWriter();
  writer_.channel(1, "/left/image_raw", "sensor_msgs/msg/Image");
  writer_.channel(2, "/right/image_raw", "sensor_msgs/msg/Image");
  writer_.channel(3, "/left/camera_info", "sensor_msgs/msg/CameraInfo");
  writer_.message(3, kStart, camera_info(0, "fov"));
  frame(0);
  EXPECT_NE(refusal().find("/left/camera_info: d is of the model \"fov\""), std::string::npos);
}

TEST_F(Bag, CameraInfoOfAnotherSizeIsRefused) {
  writer_.message(1, kStart, image(kStart, true, kWidth - 2));
  writer_.message(2, kStart, image(kStart, true, kWidth - 2));
  const std::string said = refusal();
  EXPECT_NE(said.find("left/image_raw#0"), std::string::npos) << said;
  EXPECT_NE(said.find("is 68x48 pixels, but the calibration of this camera (CameraInfo of /left "
                      "and /right) is for 70x48"),
            std::string::npos)
      << said;
}

TEST_F(Bag, CutAnywhereIsReadOrRefused) {
  for (std::int64_t i = 0; i < 2; ++i) {
    frame(i);
    writer_.close_chunk();
  }
  const std::string whole = writer_.bytes();
  for (std::size_t cut = 0; cut < whole.size(); cut += 7) {
    folder_.write("cut.mcap", whole.substr(0, cut));
    try {
      EXPECT_LE(open_sequence(SequenceFormat::mcap, folder_ / "cut.mcap").pairs.size(), 2U);
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("cut.mcap"), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace vergence::app
