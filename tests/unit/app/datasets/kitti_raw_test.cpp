#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app/datasets/detail/ascending.hpp"
#include "app/datasets/detail/kitti_raw.hpp"
#include "app/datasets/recorded_ins.hpp"
#include "app/datasets/stamp_text.hpp"
#include "app/datasets/stereo_sequence.hpp"
#include "app/runtime/errors.hpp"
#include "core/comparison/comparison.hpp"
#include "core/math/so3.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;
using test::sentence_of;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::int64_t kStart = 1'317'045'935'500'923'136;  // 2011-09-26 14:05:35.500923136 UTC
const std::string kDrive = "2011_09_26/2011_09_26_drive_0001_extract";

/// Of the data set's form, ns after kStart; within the same minute.
std::string stamp_line(std::int64_t ns) {
  const std::int64_t t = kStart - 1'317'045'900'000'000'000 + ns;
  return fmt::format("2011-09-26 14:05:{:02d}.{:09d}\n", t / 1'000'000'000, t % 1'000'000'000);
}

/// The 30 columns at a place so many metres to the north, driving there.
std::string packet(double north_m, const char* status = "4 8 4 4 0") {
  return fmt::format(
      "{:.12f} 8.4 112.3 0.02 -0.01 {:.9f} 10 0.5 10 0 0.1 0 0 9.8 0 0 9.8 0 0 0 0 0 0 0.05 0.03 "
      "{}\n",
      49.0 + north_m / 111'000, std::numbers::pi / 2, status);
}

class KittiRaw : public testing::Test {
 protected:
  static constexpr int kFrames = 6;
  KittiRaw() {
    std::string left, right, oxts;
    for (int i = 0; i < kFrames; ++i) {
      left += stamp_line(i * kStep);
      right += stamp_line(i * kStep - 1'300'000);
      for (int k = 0; k < 2; ++k) test::write_tiny_image(image(k, i), test::tiny_seed(i, k));
    }
    for (int i = 0; i < kPackets; ++i) {
      oxts += stamp_line(i * kStep / 2 + 3'000'000);
      folder_.write(oxts_name(i), packet(i));
    }
    folder_.write(times_name(0), left);
    folder_.write(times_name(1), right);
    folder_.write(kDrive + "/oxts/timestamps.txt", oxts);
    folder_.write(kCameras, cameras_text());
    folder_.write("2011_09_26/calib_velo_to_cam.txt",
                  "calib_time: 15\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.08 -0.27\n");
    folder_.write("2011_09_26/calib_imu_to_velo.txt",
                  "calib_time: 25\r\nR: 1 0 0 0 1 0 0 0 1\r\nT: -0.81 0.32 -0.8\r\n");
  }
  static std::string cameras_text() {
    std::string text = "calib_time: 09-Jan-2012\n";
    for (int k = 0; k < 4; ++k)
      text += fmt::format(
          "S_{0:02d}: 7.0e+01 4.8e+01\nK_{0:02d}: 60 0 35 0 60 24 0 0 1\nD_{0:02d}: -0.3 0.1 0.001 "
          "0.002 -0.05\n"
          "R_{0:02d}: 1 0 0 0 1 0 0 0 1\nT_{0:02d}: {1} 0 0\nS_rect_{0:02d}: 64 "
          "40\nR_rect_{0:02d}: 1 0 0 0 1 0 0 0 1\n"
          "P_rect_{0:02d}: 50 0 32 {2} 0 50 20 0 0 0 1 0\n",
          k,
          k == 0   ? 0
          : k == 2 ? 0.06
                   : -0.5,
          k == 0   ? 0
          : k == 2 ? 3
                   : -25);
    return text;
  }
  [[nodiscard]] fs::path image(int camera, int frame) const {
    return folder_ / fmt::format("{}/image_{:02d}/data/{:010d}.png", kDrive, camera, frame);
  }
  static std::string times_name(int camera) {
    return fmt::format("{}/image_{:02d}/timestamps.txt", kDrive, camera);
  }
  static std::string oxts_name(int i) { return fmt::format("{}/oxts/data/{:010d}.txt", kDrive, i); }
  [[nodiscard]] std::string text_of(const std::string& name) const {
    return test::read_file(folder_ / name);
  }
  void replace(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = text_of(name);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder_.write(name, text.replace(at, from.size(), to));
  }
  /// Line `i` of a file becomes `line` (with its end); empty: it goes.
  void set_line(const std::string& name, int i, const std::string& line) const {
    std::istringstream in(text_of(name));
    std::string out, old;
    for (int n = 0; std::getline(in, old); ++n) out += n == i ? line : old + "\n";
    folder_.write(name, out);
  }
  [[nodiscard]] StereoSequence open() const {
    return open_sequence(SequenceFormat::kitti_raw, folder_ / kDrive);
  }
  [[nodiscard]] RecordedIns ins() const {
    return read_recorded_ins(SequenceFormat::kitti_raw, folder_ / kDrive, {0, 1}, true);
  }
  [[nodiscard]] std::string refusal() const {
    return sentence_of<InputError>([&] { (void)open(); });
  }
  [[nodiscard]] std::string ins_refusal() const {
    return sentence_of<InputError>([&] { (void)ins(); });
  }
  static bool says(const std::vector<std::string>& remarks, const std::string& part) {
    for (const std::string& r : remarks)
      if (r.find(part) != std::string::npos) return true;
    return false;
  }

  static constexpr std::int64_t kStep = 100'000'000;  // ns
  static constexpr int kPackets = 10;
  const std::string kCameras = "2011_09_26/calib_cam_to_cam.txt";
  test::TemporaryFolder folder_;
};

TEST_F(KittiRaw, pairsRawImagesWithTheLeftCamerasStampsAndFiveCoefficients) {
  for (const fs::path& folder :
       {folder_ / kDrive, folder_ / "2011_09_26", folder_.path(), folder_ / (kDrive + "/")}) {
    EXPECT_EQ(find_format(folder), SequenceFormat::kitti_raw) << folder;
    const StereoSequence s = open_sequence(SequenceFormat::kitti_raw, folder);
    ASSERT_EQ(s.pairs.size(), static_cast<std::size_t>(kFrames)) << folder;
    EXPECT_EQ(s.pairs[0].stamp.ns(), kStart);
    EXPECT_EQ(s.pairs[5].stamp.ns(), kStart + 5 * kStep);
    EXPECT_EQ(s.pairs[2].file[1], "image_01/data/0000000002.png");
    EXPECT_EQ(s.calibration.intrinsics[0].distortion,
              (std::array<double, 5>{-0.3, 0.1, 0.001, 0.002, -0.05}));
    EXPECT_EQ(s.calibration.intrinsics[0].width, test::kTinyWidth);
    EXPECT_NEAR(s.calibration.T_camera_left[1].t.x(), -0.5, 1e-12);
    EXPECT_EQ(s.left_out, 0U);
    EXPECT_TRUE(s.remarks.empty()) << s.remarks[0];
  }
}

TEST_F(KittiRaw, aDriveThatIsALinkTakesTheCalibrationBesideTheLink) {
  fs::create_directories(folder_ / "elsewhere");
  const fs::path link = folder_ / "elsewhere/2011_09_26_drive_0001_extract";
  fs::create_directory_symlink(folder_ / kDrive, link);
  EXPECT_EQ(open_sequence(SequenceFormat::kitti_raw, link).calibration.intrinsics[0].cx, 35)
      << "there is none beside it";
  std::string text = cameras_text();
  folder_.write("elsewhere/calib_cam_to_cam.txt", text.replace(text.find("60 0 35"), 7, "60 0 36"));
  EXPECT_EQ(open_sequence(SequenceFormat::kitti_raw, link).calibration.intrinsics[0].cx, 36);
}

TEST_F(KittiRaw, imagesOfTheRectifiedSizeTakeTheRectifiedCalibration) {
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < kFrames; ++i)
      test::write_tiny_image(image(k, i), test::tiny_seed(i, k), 64, 40);
  const StereoSequence s = open();
  EXPECT_FALSE(s.calibration.intrinsics[0].has_distortion());
  EXPECT_EQ(s.calibration.intrinsics[1].fx, 50);
  EXPECT_EQ(s.calibration.T_camera_left[1].R, Mat3::Identity());
  EXPECT_NEAR(s.calibration.T_camera_left[1].t.x(), -0.5, 1e-12);
}

TEST_F(KittiRaw, imagesOfNeitherSizeAreRefused) {
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < kFrames; ++i)
      test::write_tiny_image(image(k, i), test::tiny_seed(i, k), 80, 40);
  EXPECT_NE(refusal().find("calib_cam_to_cam.txt:2: is for images of 70x48 pixels, or 64x40 "
                           "rectified, but those of the drive have 80x40"),
            std::string::npos)
      << refusal();
}

TEST_F(KittiRaw, theColourCamerasByKey) {
  fs::rename(folder_ / (kDrive + "/image_00"), folder_ / (kDrive + "/image_02"));
  fs::rename(folder_ / (kDrive + "/image_01"), folder_ / (kDrive + "/image_03"));
  EXPECT_NE(refusal().find("image_00"), std::string::npos) << refusal();
  const StereoSequence s =
      open_sequence(SequenceFormat::kitti_raw, folder_ / kDrive, std::nullopt, {}, {2, 3});
  EXPECT_EQ(s.pairs.size(), static_cast<std::size_t>(kFrames));
  EXPECT_NEAR(s.calibration.T_camera_left[1].t.x(), -0.56, 1e-12);
  EXPECT_NE(
      sentence_of<InputError>([&] {
        (void)open_sequence(SequenceFormat::kitti_raw, folder_ / kDrive, std::nullopt, {}, {2, 2});
      }).find("are both camera 2"),
      std::string::npos);
  // The left one is 6 cm to the left of camera 00.
  const auto at = [&](int left, int right) {
    return *read_recorded_ins(SequenceFormat::kitti_raw, folder_ / kDrive, {left, right}, true)
                .T_ins_left;
  };
  EXPECT_NEAR(at(2, 3).t.y(), -0.32 + 0.06, 1e-9);
}

TEST_F(KittiRaw, aCameraThatLosesImagesIsPairedByStamps) {
  // As "extract" has it: the right camera missed frame 2, and its files are numbered on.
  for (int i = 2; i + 1 < kFrames; ++i) fs::rename(image(1, i + 1), image(1, i));
  set_line(times_name(1), 2, "");
  const StereoSequence s = open();
  ASSERT_EQ(s.pairs.size(), 5U);
  EXPECT_EQ(s.pairs[2].file[0], "image_00/data/0000000003.png");
  EXPECT_EQ(s.pairs[2].file[1], "image_01/data/0000000002.png");
  EXPECT_EQ(s.left_out, 1U);
  EXPECT_TRUE(says(s.remarks, "image_00: 1 images have no partner of image_01"));
}

TEST_F(KittiRaw, timestampsShorterThanTheImagesLeaveTheRestOut) {
  folder_.write(times_name(0), stamp_line(0) + stamp_line(kStep) + stamp_line(2 * kStep) +
                                   "2011-09-26 14:05:35.8");  // cut off
  const StereoSequence s = open();
  EXPECT_EQ(s.pairs.size(), 3U);
  EXPECT_EQ(s.left_out, 3U);
  EXPECT_TRUE(says(s.remarks,
                   "image_00: 3 images have no stamp and are left out: timestamps.txt has 4 lines, "
                   "1 of them broken, the first is line 4"))
      << s.remarks[0];
}

TEST_F(KittiRaw, timestampsLongerThanTheImagesAreToldOnce) {
  for (int k = 0; k < 2; ++k)
    for (int i = 3; i < kFrames; ++i) fs::remove(image(k, i));
  const StereoSequence s = open();
  EXPECT_EQ(s.pairs.size(), 3U);
  EXPECT_EQ(s.left_out, 0U);
  EXPECT_TRUE(says(s.remarks, "image_01: timestamps.txt goes on for 3 lines after the last image"));
}

TEST_F(KittiRaw, anImageMissingInTheMiddleIsMissedWhenItsFrameComes) {
  fs::remove(image(1, 3));
  EXPECT_EQ(open().pairs.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(open().pairs[3].file[1], "image_01/data/0000000003.png");
}

TEST_F(KittiRaw, aStampThatGoesBackOrLeapsCostsItsOwnFrameOnly) {
  for (const std::int64_t wrong : {-20 * kStep, 20 * kStep}) {
    for (int k = 0; k < 2; ++k) set_line(times_name(k), 2, stamp_line(wrong - k * 1'300'000));
    const StereoSequence both = open();
    EXPECT_EQ(both.pairs.size(), 5U) << wrong;
    EXPECT_EQ(both.left_out, 1U);
    EXPECT_TRUE(says(both.remarks, "1 stamps go back or repeat one"));
    set_line(times_name(1), 2, stamp_line(2 * kStep - 1'300'000));
    const StereoSequence one = open();  // the right camera's is right
    EXPECT_EQ(one.pairs.size(), 5U) << wrong;
    EXPECT_EQ(one.left_out, 1U);
  }
}

TEST_F(KittiRaw, carriageReturnsAndStrayFilesDoNoHarm) {
  std::string text;
  for (const char c : text_of(times_name(0))) text += c == '\n' ? "\r\n" : std::string(1, c);
  folder_.write(times_name(0), text);
  folder_.write(kDrive + "/image_00/data/._0000000000.png", "x");
  folder_.write(kDrive + "/image_00/data/thumbnail.png", "x");
  const StereoSequence s = open();
  EXPECT_EQ(s.pairs.size(), static_cast<std::size_t>(kFrames));
  EXPECT_TRUE(says(s.remarks, "1 images that are not named by their number"));
}

TEST_F(KittiRaw, whatIsNoDriveIsRefusedWithFileAndLine) {
  const auto broken = [this](const std::string& name, const std::string& text,
                             const std::string& expected) {
    const std::string good = text_of(name);
    folder_.write(name, text);
    EXPECT_NE(refusal().find(expected), std::string::npos) << expected << "\n" << refusal();
    folder_.write(name, good);
  };
  broken(times_name(0), "", "timestamps.txt: has no stamp");
  broken(times_name(0), "no\nstamps\n", "timestamps.txt:1: has no stamp like");
  broken(times_name(1), "2012-01-01 00:00:00.000000000\n", "never agree");
  std::string text = cameras_text();
  broken(kCameras, text.substr(0, text.find("D_01") + 12),
         "calib_cam_to_cam.txt:12: D_01: has 2 numbers where 5 are expected");
  broken(kCameras, text.substr(0, text.find("R_01")), "has no line `R_01:`, 9 numbers");
  text.replace(text.find("R_01: 1 0"), 9, "R_01: 1 x");
  broken(kCameras, text, "calib_cam_to_cam.txt:13: R_01: `x` is not a finite number");
  text.replace(text.find("R_01: 1 x"), 9, "R_01: 1 2");
  broken(kCameras, text, "R_01: is no rotation");
  fs::remove(folder_ / kCameras);
  EXPECT_NE(refusal().find("calib_cam_to_cam.txt: is missing: unpack the date's calibration there, "
                           "or give one with --calibration"),
            std::string::npos);
  fs::remove(folder_ / times_name(1));
  EXPECT_NE(refusal().find("image_01/timestamps.txt: cannot be opened"), std::string::npos)
      << refusal();
  fs::create_directories(folder_ / "2011_09_26/2011_09_26_drive_0002_extract/image_00");
  const std::string several = sentence_of<InputError>(
      [&] { (void)open_sequence(SequenceFormat::kitti_raw, folder_ / "2011_09_26"); });
  EXPECT_NE(several.find("holds 2 drives (2011_09_26_drive_0001_extract, "
                         "2011_09_26_drive_0002_extract): name one"),
            std::string::npos)
      << several;
  EXPECT_NE(sentence_of<InputError>([&] {
              (void)open_sequence(SequenceFormat::kitti_raw, folder_ / kDrive / "oxts");
            }).find("no KITTI raw drive"),
            std::string::npos);
}

TEST_F(KittiRaw, stampsAreUtcToTheNanosecond) {
  EXPECT_EQ(parse_iso_time("2011-09-26 14:05:35.500923136")->ns(), kStart);
  EXPECT_EQ(parse_iso_time("2012-02-29 00:00:00")->ns(), 1'330'473'600'000'000'000);
  EXPECT_EQ(parse_iso_time("1970-01-01 00:00:00.1")->ns(), 100'000'000);
  for (const char* wrong : {"", "2011-09-26", "2011-02-30 00:00:00", "2011-09-26 24:00:00",
                            "2011-09-26 14:05:35.", "2011-09-26 14:05:35.5e3", "2011-09-26 14:05:3",
                            "2011-09-26 14:05:35 x", "-011-09-26 14:05:35"})
    EXPECT_FALSE(parse_iso_time(wrong)) << wrong;
}

TEST(KittiStamps, theLongestAscendingPartStays) {
  const auto of = [](const std::vector<std::int64_t>& values) {
    std::vector<Stamp> stamps;
    for (const std::int64_t v : values) stamps.emplace_back(v);
    return detail::ascending(stamps);
  };
  using Places = std::vector<std::size_t>;
  EXPECT_EQ(of({}), Places{});
  EXPECT_EQ(of({1, 2, 3}), (Places{0, 1, 2}));
  EXPECT_EQ(of({1, 99, 2, 3}), (Places{0, 2, 3}));
  EXPECT_EQ(of({5, 6, 1, 7, 7, 8}), (Places{0, 1, 3, 5}));
  EXPECT_EQ(of({9, 8, 7}), (Places{2}));
}

// ---- INS

TEST_F(KittiRaw, packetsBecomeSamplesInEastNorthUp) {
  const RecordedIns recorded = ins();
  ASSERT_EQ(recorded.readings.size(), static_cast<std::size_t>(kPackets));
  EXPECT_TRUE(recorded.remarks.empty()) << recorded.remarks[0];
  const InsSample& s = recorded.readings[3].sample;
  EXPECT_EQ(s.stamp.ns(), kStart + 3 * kStep / 2 + 3'000'000);
  EXPECT_EQ(s.number, 3U);
  EXPECT_EQ(s.fix, FixStatus::fix_3d);
  EXPECT_TRUE(s.attitude_valid && s.velocity_valid);
  EXPECT_NEAR(s.position.latitude_deg, 49.0 + 3.0 / 111'000, 1e-11);
  EXPECT_EQ(s.velocity_enu, (std::array<double, 3>{0.5, 10, 0.1}));
  EXPECT_EQ(s.position_sigma, 0.05);
  EXPECT_EQ(s.velocity_sigma, 0.03);
  EXPECT_EQ(recorded.readings[3].quality.satellites, 8);
  // The body looks north (yaw π/2 from east): its left is west; roll 0.02 lifts the left side,
  // pitch −0.01 the front.
  const Mat3 R = Eigen::Quaterniond(s.q_enu_ins[3], s.q_enu_ins[0], s.q_enu_ins[1], s.q_enu_ins[2])
                     .toRotationMatrix();
  EXPECT_NEAR(R(1, 0), std::cos(0.01), 1e-9);
  EXPECT_NEAR(R(2, 0), std::sin(0.01), 1e-9);
  EXPECT_NEAR(R(0, 1), -std::cos(0.02), 1e-9);
  EXPECT_NEAR(R(2, 1), std::sin(0.02) * std::cos(0.01), 1e-9);
}

/// The record that three public sources quote of this data set, with what the development kit makes
/// of its angles.
TEST_F(KittiRaw, aRecordOfTheDataSetHasTheDevelopmentKitsAttitude) {
  folder_.write(
      oxts_name(0),
      "49.011212804408 8.4228850417969 112.83492279053 0.022447 1e-05 -1.2219096732051 "
      "-3.3256321640686 1.1384311814592 3.5147680214713 "
      "0.037625160413037 -0.03878884255623 0 0 0 0 0 0 0 0 0 0 0 0 0.05 0.03 4 8 5 5 5\n");
  const InsSample s = ins().readings[0].sample;
  Mat3 expected;
  expected << 0.341851747899, 0.939517225418, -0.021089466574, -0.939753894569, 0.341765416558,
      -0.007682296964, -0.000010000000, 0.022445114993, 0.999748076624;
  const Mat3 R = Eigen::Quaterniond(s.q_enu_ins[3], s.q_enu_ins[0], s.q_enu_ins[1], s.q_enu_ins[2])
                     .toRotationMatrix();
  EXPECT_LT((R - expected).cwiseAbs().maxCoeff(), 1e-9);
  // Forward of the body is where it goes.
  const Vec3 v(s.velocity_enu[0], s.velocity_enu[1], s.velocity_enu[2]);
  EXPECT_NEAR((R.transpose() * v).x(), 3.5147680214713, 1e-3);
}

TEST_F(KittiRaw, theMountIsThatOfTheCalibrationFiles) {
  const Transform T = *ins().T_ins_left;
  // Camera 00 is 0.27 m ahead of the laser scanner's centre and 0.08 m above it; the scanner 0.81 m
  // ahead of the INS, 0.32 m to its right, 0.8 m above.
  EXPECT_NEAR(T.t.x(), 0.81 + 0.27, 1e-9);
  EXPECT_NEAR(T.t.y(), -0.32, 1e-9);
  EXPECT_NEAR(T.t.z(), 0.8 - 0.08, 1e-9);
  EXPECT_LT(boresight_of(T.R).norm(), 1e-9);
  EXPECT_FALSE(
      read_recorded_ins(SequenceFormat::kitti_raw, folder_ / kDrive, {0, 1}, false).T_ins_left);
}

TEST_F(KittiRaw, packetsMissingBrokenOrOutOfOrderAreLeftOutAndCounted) {
  fs::remove(folder_ / oxts_name(2));
  folder_.write(oxts_name(4), packet(4).substr(0, 90));
  folder_.write(oxts_name(5), "");
  set_line(kDrive + "/oxts/timestamps.txt", 7, stamp_line(0));
  folder_.write(oxts_name(12), packet(12));
  const RecordedIns recorded = ins();
  EXPECT_EQ(recorded.readings.size(), 6U);
  for (std::size_t i = 1; i < recorded.readings.size(); ++i)
    EXPECT_LT(recorded.readings[i - 1].sample.stamp, recorded.readings[i].sample.stamp);
  EXPECT_TRUE(says(recorded.remarks, "oxts: 1 packets are missing, the first is 0000000002.txt"));
  EXPECT_TRUE(says(recorded.remarks,
                   "oxts: 2 packets are not the 30 numbers of one and are left out, the first is "
                   "0000000004.txt"));
  EXPECT_TRUE(says(recorded.remarks, "oxts: 1 stamps go back"));
  EXPECT_TRUE(says(recorded.remarks, "oxts: 1 packets have no line in timestamps.txt"));
}

TEST_F(KittiRaw, aPacketWithoutAFixHasNone) {
  folder_.write(oxts_name(1), packet(1, "0 8 4 4 0"));    // the unit is starting
  folder_.write(oxts_name(2), packet(2, "4 0 4 4 0"));    // no satellite
  folder_.write(oxts_name(3), packet(3, "4 8 0 0 0"));    // no position mode
  folder_.write(oxts_name(4), packet(4, "4 8 11 11 0"));  // blanked
  folder_.write(oxts_name(5), packet(5, "4 -1 6 6 6"));   // satellites are not told
  const auto readings = ins().readings;
  EXPECT_EQ(readings[1].sample.fix, FixStatus::none);
  EXPECT_EQ(readings[2].sample.fix, FixStatus::dead_reckoning);
  EXPECT_EQ(readings[3].sample.fix, FixStatus::dead_reckoning);
  EXPECT_EQ(readings[4].sample.fix, FixStatus::dead_reckoning);
  EXPECT_EQ(readings[5].sample.fix, FixStatus::fix_3d);
  EXPECT_TRUE(says(ins().remarks, "oxts: 4 of 10 packets have no satellites' fix"));
}

TEST_F(KittiRaw, anInsThatCannotBeReadIsRefusedAndOneThatIsNotThereIsTold) {
  const std::string imu = "2011_09_26/calib_imu_to_velo.txt";
  replace(imu, "R: 1 0 0", "R: 1 0.1 0");
  EXPECT_NE(ins_refusal().find("calib_imu_to_velo.txt:2: R: is no rotation"), std::string::npos)
      << ins_refusal();
  fs::remove(folder_ / imu);
  EXPECT_NE(ins_refusal().find("calib_imu_to_velo.txt: is missing"), std::string::npos)
      << ins_refusal();
  for (int i = 0; i < kPackets; ++i) folder_.write(oxts_name(i), "1 2 3\n");
  EXPECT_NE(
      ins_refusal().find("0000000000.txt: is no packet of the INS, and so is every other packet"),
      std::string::npos)
      << ins_refusal();
  fs::remove_all(folder_ / (kDrive + "/oxts/data"));
  EXPECT_NE(ins_refusal().find("oxts/data: does not exist"), std::string::npos) << ins_refusal();
  fs::remove_all(folder_ / (kDrive + "/oxts"));
  const RecordedIns none = ins();
  EXPECT_TRUE(none.readings.empty());
  EXPECT_TRUE(says(none.remarks, "there is no INS to compare with"));
}

TEST(KittiRawSample, hasTheDataSetsFiguresInAllOfItsParts) {
  const auto folder = test::shared_data("data/kitti_raw_0039_20");
  if (!folder) GTEST_SKIP() << test::shared_data_missing("data/kitti_raw_0039_20");
  const StereoSequence s = open_sequence(SequenceFormat::kitti_raw, *folder);
  ASSERT_EQ(s.pairs.size(), 20U);
  EXPECT_EQ(s.pairs[0].stamp.ns(), kStart);
  EXPECT_EQ(s.calibration.intrinsics[1].distortion[4], -5.314062e-02);
  EXPECT_NEAR(s.calibration.baseline, 0.53716, 1e-4);
  const RecordedIns recorded = read_recorded_ins(SequenceFormat::kitti_raw, *folder, {0, 1}, true);
  ASSERT_EQ(recorded.readings.size(), 30U);
  EXPECT_TRUE(recorded.remarks.empty());
  const Vec3 turn = boresight_of(recorded.T_ins_left->R) * kDegrees;
  EXPECT_LT(turn.cwiseAbs().maxCoeff(), 1.0) << "mounted forward, by the drawing";
  EXPECT_NEAR(recorded.T_ins_left->t.x(), 1.083,
              1e-3);  // 0.81 and 0.27 m ahead in the data set's drawing
}

}  // namespace
}  // namespace vergence::app
