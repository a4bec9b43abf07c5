#include <sqlite3.h>

#include "app/datasets/detail/bag_index.hpp"
#include "app/datasets/ros_camera.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/ros_messages.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using test::BagKind;
using test::mentions;
using test::Wire;

/// Times in ns.
constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kStep = 50'000'000;
/// Width and height in px, stride in bytes.
constexpr std::uint32_t kWidth = 70, kHeight = 48, kStride = 80;

char pixel(std::uint32_t x, std::uint32_t y) { return static_cast<char>((3 * x + 5 * y) & 0xFFU); }

std::string image(Wire wire, std::int64_t stamp, std::uint32_t width = kWidth) {
  std::string data(std::size_t{kStride} * kHeight, '\0');
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < width; ++x) data[y * kStride + x] = pixel(x, y);
  return image_message(wire, stamp, {width, kHeight, kStride, "mono8", data});
}

/// CameraInfo of a rectified pair 0.12 m apart, f = 60.
std::string camera_info(Wire wire, double fx_times_b, const std::string& model = "plumb_bob") {
  return camera_info_message(
      wire, kStart,
      {kWidth, kHeight, model, {-0.1, 0.01, 0.001, 0.002, 0.0}, 60, 61, 35, 24, fx_times_b});
}

class Bag : public ::testing::TestWithParam<BagKind> {
 protected:
  Bag() {
    begin();
    writer_->channel(4, "/right/camera_info", "sensor_msgs/CameraInfo");
    writer_->message(3, kStart, camera_info(wire(), 0));
    writer_->message(4, kStart, camera_info(wire(), -7.2));
  }
  void begin() {
    writer_ = GetParam().writer();
    writer_->channel(1, "/left/image_raw", "sensor_msgs/Image");
    writer_->channel(2, "/right/image_raw", "sensor_msgs/Image");
    writer_->channel(3, "/left/camera_info", "sensor_msgs/CameraInfo");
  }
  [[nodiscard]] static Wire wire() { return GetParam().wire(); }
  void frame(std::int64_t i, std::int64_t late = 0) {
    const Wire other = GetParam().is_mcap() ? Wire::cdr_big : wire();
    writer_->message(1, kStart, image(wire(), kStart + i * kStep));
    writer_->message(2, kStart, image(other, kStart + i * kStep + late));
  }
  void left(std::int64_t stamp, std::uint32_t width = kWidth) {
    writer_->message(1, kStart, image(wire(), stamp, width));
  }
  [[nodiscard]] static SequenceFormat format() {
    return GetParam().is_mcap() ? SequenceFormat::mcap : SequenceFormat::rosbag;
  }
  [[nodiscard]] StereoSequence open(const BagTopics& topics = {}) {
    writer_->finish();
    folder_.write("drive/drive_0" + GetParam().ending(), writer_->bytes());
    return open_sequence(format(), folder_ / "drive", {.topics = topics});
  }
  [[nodiscard]] std::string refusal(const BagTopics& topics = {}) {
    return test::refusal_of([&] { (void)open(topics); });
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<test::BagWriter> writer_;
};

TEST_P(Bag, readsPairsCalibrationAndPixels) {
  for (std::int64_t i = 0; i < 4; ++i) frame(i, 1'000'000);
  const StereoSequence s = open();
  EXPECT_EQ(find_format(folder_ / "drive"), format());
  ASSERT_EQ(s.pairs.size(), 4U);
  EXPECT_EQ(s.left_out, 0U);
  EXPECT_EQ(s.pairs[2].stamp.ns(), kStart + 2 * kStep);
  EXPECT_EQ(s.calibration.intrinsics[1].fy, 61);
  EXPECT_EQ(s.calibration.intrinsics[0].distortion[0], -0.1);
  EXPECT_NEAR((s.calibration.T_camera_left[1].t - Vec3(-0.12, 0, 0)).norm(), 0, 1e-15);
  std::vector<std::uint8_t> out(std::size_t{kWidth} * kHeight), work;
  for (const std::string& name : s.pairs[3].file) {
    ASSERT_EQ(s.store->decode(name, {kWidth, kHeight}, out.data(), kWidth, 16, &work),
              ImageFileStatus::ok)
        << name;
    for (std::uint32_t y = 0; y < kHeight; ++y)
      for (std::uint32_t x = 0; x < kWidth; ++x)
        ASSERT_EQ(out[y * kWidth + x], static_cast<std::uint8_t>(pixel(x, y)));
  }
  EXPECT_EQ(s.store->decode("left/image_raw#4", {kWidth, kHeight}, out.data(), kWidth, 16, &work),
            ImageFileStatus::missing);
}

// That of a recorder whose power went; and both kinds in one folder.
TEST_P(Bag, readsActiveBagAndPrefersNewerKind) {
  frame(0);
  writer_->finish();
  const std::string name = GetParam().is_mcap() ? "drive_0.MCAP" : "drive_0.bag.active";
  folder_.write("drive/" + name, writer_->bytes());
  EXPECT_EQ(find_format(folder_ / "drive" / name), format());
  EXPECT_EQ(find_format(folder_ / "drive"), format());
  EXPECT_EQ(open_sequence(format(), folder_ / "drive").pairs.size(), 1U);
  folder_.write("drive/a.mcap", ""), folder_.write("drive/z.bag", "");
  EXPECT_EQ(find_format(folder_ / "drive"), SequenceFormat::mcap);
}

TEST_P(Bag, countsImagesOfOtherSizeOrBackwardStamp) {
  for (std::int64_t i = 0; i < 4; ++i) frame(i);
  left(kStart + 4 * kStep, kWidth - 2);
  left(kStart + kStep);
  writer_->message(1, 0, image(wire(), kStart + 5 * kStep).substr(0, 300));
  const StereoSequence s = open();
  EXPECT_EQ(s.pairs.size(), 4U);
  EXPECT_EQ(s.left_out, 3U);
  ASSERT_EQ(s.remarks.size(), 1U);
  EXPECT_TRUE(mentions(
      s.remarks[0],
      "1 unreadable images, 1 of another size than the first and 1 whose stamps do not increase"));
  EXPECT_TRUE(mentions(s.remarks[0], "drive_0" + GetParam().ending() + ", offset "));
}

TEST_P(Bag, listsTopicsAndUsesNamedOne) {
  writer_->channel(5, "/left/image_small", "sensor_msgs/Image");
  writer_->message(5, 0, image(wire(), kStart));
  for (std::int64_t i = 0; i < 4; ++i) frame(i);
  writer_->channel(6, "/right/image_small", "sensor_msgs/Image");
  writer_->message(6, 0, image(wire(), kStart));
  const std::string said = refusal();
  EXPECT_TRUE(mentions(said, "--left-topic"));
  EXPECT_TRUE(mentions(said, "/left/image_raw (4 images), /left/image_small (1 images)"));
  EXPECT_EQ(open({"/left/image_raw", ""}).pairs.size(), 4U) << "the right one follows";
}

// Drivers that set no stamp; the time of recording less the usual delay is what is left.
TEST_P(Bag, replacesZeroStampsByRecordingTime) {
  for (std::int64_t i = 0; i < 5; ++i) {
    const std::int64_t stamp = kStart + i * kStep;
    writer_->message(1, stamp + 7'000'000, image(wire(), i == 2 ? 0 : stamp));
    writer_->message(2, stamp + 7'000'000, image(wire(), stamp));
  }
  const StereoSequence s = open();
  ASSERT_EQ(s.pairs.size(), 5U);
  EXPECT_EQ(s.pairs[2].stamp.ns(), kStart + 2 * kStep);
  EXPECT_TRUE(mentions(s.assumptions.front(), "1 images have no stamp"));
}

TEST_P(Bag, refusesCameraInfoOfOtherSize) {
  left(kStart, kWidth - 2);
  writer_->message(2, kStart, image(wire(), kStart, kWidth - 2));
  const std::string said = refusal();
  EXPECT_TRUE(mentions(said, "left/image_raw#0",
                       "is 68x48 pixels, but the calibration of this camera (CameraInfo of /left "
                       "and /right) is for 70x48"));
}

TEST_P(Bag, refusesOtherFilesByHeader) {
  folder_.write("drive/a" + GetParam().ending(), "#ROSBAG V1.2\n");
  EXPECT_TRUE(mentions(test::refusal_of([&] { (void)open_sequence(format(), folder_ / "drive"); }),
                       "is not a"));
}

// The image: 96 × 72, f = 80 px, its middle the principal point. The sensor: twice as large, or
// some pixels around it.
TEST(CameraInfo, appliesBinningAndRegionByRep104) {
  struct Case {
    const char* what;
    /// Focal length and centre in CameraInfo.
    double f, cx, cy;
    ImageSize size;
    /// Binning x and y, offset x and y, height, width.
    RosCrop crop;
    bool assumed;
  };
  constexpr ImageSize kImage{96, 72};
  for (const Case& c :
       {Case{"none", 80, 48, 36, kImage, {}, false},
        Case{"binned", 160, 96, 72, {192, 144}, {2, 2, 0, 0, 0, 0}, false},
        Case{"a region", 80, 112, 68, {224, 136}, {0, 0, 64, 32, 72, 96}, false},
        Case{"a region, binned", 160, 136, 92, {272, 184}, {2, 2, 40, 20, 144, 192}, false},
        Case{"K of the binned image", 80, 48, 36, {192, 144}, {2, 2, 0, 0, 0, 0}, true},
        Case{"K and size of the binned image", 80, 48, 36, kImage, {2, 2, 0, 0, 0, 0}, true}}) {
    RosCamera camera;
    camera.lens.width = c.size.width, camera.lens.height = c.size.height;
    camera.lens.fx = camera.lens.fy = c.f, camera.lens.cx = c.cx, camera.lens.cy = c.cy;
    camera.P << c.f, 0, c.cx, -0.11 * c.f, 0, c.f, c.cy, 0, 0, 0, 1, 0;
    EXPECT_EQ(!apply_crop(c.crop, kImage, &camera).empty(), c.assumed) << c.what;
    const Intrinsics& k = camera.lens;
    EXPECT_EQ((ImageSize{k.width, k.height}), kImage) << c.what;
    EXPECT_NEAR((Vec3(k.fx, k.cx, k.cy) - Vec3(80, 48, 36)).norm(), 0, 1e-12) << c.what;
    EXPECT_NEAR((Vec3(camera.P(0, 0), camera.P(0, 2), camera.P(1, 2)) - Vec3(80, 48, 36)).norm(), 0,
                1e-12)
        << c.what;
    EXPECT_NEAR(camera.P(0, 3) / camera.P(0, 0), -0.11, 1e-12) << "the baseline stays";
  }
}

/// As rosbag2 writes a .db3.
void write_db3(const std::filesystem::path& file, int pairs) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  const auto run = [&](const std::string& sql) {
    ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
  };
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT, offered_qos_profiles TEXT)");
  run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data "
      "BLOB)");
  const std::array<std::string, 4> topics{"left/image_raw", "right/image_raw", "left/camera_info",
                                          "right/camera_info"};
  for (std::size_t id = 1; id <= topics.size(); ++id)
    run("INSERT INTO topics VALUES(" + std::to_string(id) + ", '/" + topics[id - 1] +
        "', 'sensor_msgs/msg/" + (id < 3 ? "Image" : "CameraInfo") + "', 'cdr', '')");
  const auto message = [&](int topic, std::int64_t time, const std::string& content) {
    sqlite3_stmt* insert = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(database,
                                 "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                                 -1, &insert, nullptr),
              SQLITE_OK);
    sqlite3_bind_int(insert, 1, topic);
    sqlite3_bind_int64(insert, 2, time);
    sqlite3_bind_blob(insert, 3, content.data(), static_cast<int>(content.size()),
                      SQLITE_TRANSIENT);
    EXPECT_EQ(sqlite3_step(insert), SQLITE_DONE);
    sqlite3_finalize(insert);
  };
  message(3, kStart, camera_info(Wire::cdr, 0));
  message(4, kStart, camera_info(Wire::cdr, -7.2));
  // Rows need not be in the order of time.
  for (int i = pairs; i-- > 0;)
    for (int k = 1; k <= 2; ++k)
      message(k, kStart + i * kStep, image(Wire::cdr, kStart + i * kStep));
  sqlite3_close(database);
}

TEST(Db3, readsSplitSqliteBagInFolder) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "drive?#%");
  const auto file = folder / "drive?#%" / "drive_0.db3";
  write_db3(file, 4);
  folder.write("drive?#%/metadata.yaml", "rosbag2_bagfile_information: {version: 5}\n");
  EXPECT_EQ(find_format(folder / "drive?#%"), SequenceFormat::db3);
  EXPECT_EQ(find_format(file), SequenceFormat::db3);
  const StereoSequence s = open_sequence(SequenceFormat::db3, folder / "drive?#%");
  ASSERT_EQ(s.pairs.size(), 4U);
  EXPECT_EQ(s.pairs[3].stamp.ns(), kStart + 3 * kStep);
  EXPECT_NEAR((s.calibration.T_camera_left[1].t - Vec3(-0.12, 0, 0)).norm(), 0, 1e-15);
  std::vector<std::uint8_t> out(std::size_t{kWidth} * kHeight), work;
  ASSERT_EQ(s.store->decode(s.pairs[1].file[1], {kWidth, kHeight}, out.data(), kWidth, 16, &work),
            ImageFileStatus::ok);
  EXPECT_EQ(out[5 * kWidth + 7], static_cast<std::uint8_t>(pixel(7, 5)));
}

INSTANTIATE_TEST_SUITE_P(Kinds, Bag,
                         ::testing::Values(BagKind{"mcap", ""}, BagKind{"mcap", "lz4"},
                                           BagKind{"rosbag", "none"}, BagKind{"rosbag", "lz4"},
                                           BagKind{"rosbag", "bz2"}));

}  // namespace
}  // namespace vergence::app
