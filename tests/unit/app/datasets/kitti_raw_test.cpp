#include <cmath>
#include <numbers>

#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/times_file.hpp"
#include "core/comparison/comparison.hpp"
#include "tests/support/refusal.hpp"
#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

namespace fs = std::filesystem;
using test::mentions;
using test::refusal_of;

/// 2011-09-26 14:05:35.500923136 UTC in ns.
constexpr std::int64_t kStart = 1'317'045'935'500'923'136;
/// Frame interval in ns.
constexpr std::int64_t kStep = 100'000'000;
constexpr int kFrames = 6, kPackets = 10;
const std::string kDrive = "2011_09_26/2011_09_26_drive_0001_extract";
const std::string kCameras = "2011_09_26/calib_cam_to_cam.txt",
                  kImu = "2011_09_26/calib_imu_to_velo.txt";

/// Stamp in the data set's format, ns after kStart within the same minute.
std::string stamp_line(std::int64_t ns) {
  const std::int64_t t = kStart - 1'317'045'900'000'000'000 + ns;
  return fmt::format("2011-09-26 14:05:{:02d}.{:09d}\n", t / 1'000'000'000, t % 1'000'000'000);
}
std::string stamps(int count, std::int64_t step, std::int64_t first) {
  std::string text;
  for (int i = 0; i < count; ++i) text += stamp_line(first + i * step);
  return text;
}

/// The 30 columns at a place so many metres to the north, driving there.
std::string packet(double north_m, const char* status = "4 8 4 4 0") {
  return fmt::format(
      "{:.12f} 8.4 112.3 0.02 -0.01 {:.9f} 10 0.5 10 0 0.1 0 0 9.8 0 0 9.8 0 0 0 0 0 0 0.05 0.03 "
      "{}\n",
      49.0 + north_m / 111'000, std::numbers::pi / 2, status);
}
std::string times_name(int camera) {
  return fmt::format("{}/image_{:02d}/timestamps.txt", kDrive, camera);
}
std::string image_name(int camera, int frame) {
  return fmt::format("{}/image_{:02d}/data/{:010d}.png", kDrive, camera, frame);
}
std::string oxts_name(int i) { return fmt::format("{}/oxts/data/{:010d}.txt", kDrive, i); }

std::string cameras_text() {
  std::string text = "calib_time: 09-Jan-2012\n";
  for (const auto& [k, x, p3] : {std::tuple{0, 0.0, 0.0}, std::tuple{1, -0.5, -25.0},
                                 std::tuple{2, 0.06, 3.0}, std::tuple{3, -0.5, -25.0}})
    text += fmt::format(
        "S_{0:02d}: 7.0e+01 4.8e+01\nK_{0:02d}: 60 0 35 0 60 24 0 0 1\nD_{0:02d}: -0.3 0.1 0.001 "
        "0.002 -0.05\nR_{0:02d}: 1 0 0 0 1 0 0 0 1\nT_{0:02d}: {1} 0 0\nS_rect_{0:02d}: 64 40\n"
        "R_rect_{0:02d}: 1 0 0 0 1 0 0 0 1\nP_rect_{0:02d}: 50 0 32 {2} 0 50 20 0 0 0 1 0\n",
        k, x, p3);
  return text;
}

void write_images(const test::TemporaryFolder& f, int width, int height) {
  for (int i = 0; i < kFrames; ++i)
    for (int k = 0; k < 2; ++k)
      test::write_tiny_image(f / image_name(k, i), test::tiny_seed(i, k), width, height);
}

void write_drive(const test::TemporaryFolder& f) {
  write_images(f, test::kTinyWidth, test::kTinyHeight);
  for (int i = 0; i < kPackets; ++i) f.write(oxts_name(i), packet(i));
  f.write(times_name(0), stamps(kFrames, kStep, 0));
  f.write(times_name(1), stamps(kFrames, kStep, -1'300'000));
  f.write(kDrive + "/oxts/timestamps.txt", stamps(kPackets, kStep / 2, 3'000'000));
  f.write(kCameras, cameras_text());
  f.write("2011_09_26/calib_velo_to_cam.txt",
          "calib_time: 15\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.08 -0.27\n");
  f.write(kImu, "calib_time: 25\r\nR: 1 0 0 0 1 0 0 0 1\r\nT: -0.81 0.32 -0.8\r\n");
}

StereoSequence open(const test::TemporaryFolder& f, const std::array<int, 2>& cameras = {0, 1}) {
  return open_sequence(SequenceFormat::kitti_raw, f / kDrive, {.cameras = cameras});
}
RecordedIns ins(const test::TemporaryFolder& f) {
  return read_recorded_ins(SequenceFormat::kitti_raw, f / kDrive, {0, 1}, true);
}
void replace(const test::TemporaryFolder& f, const std::string& name, const std::string& from,
             const std::string& to) {
  std::string text = test::read_file(f / name);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  f.write(name, text.replace(at, from.size(), to));
}
std::string joined(const std::vector<std::string>& messages) {
  return fmt::format("{}", fmt::join(messages, "; "));
}

TEST(KittiRaw, findsDriveFromAnyFolderLevel) {
  const test::TemporaryFolder f;
  write_drive(f);
  for (const fs::path& folder : {f / kDrive, f / "2011_09_26", f.path(), f / (kDrive + "/")}) {
    EXPECT_EQ(find_format(folder), SequenceFormat::kitti_raw) << folder;
    const StereoSequence s = open_sequence(SequenceFormat::kitti_raw, folder);
    ASSERT_EQ(s.pairs.size(), static_cast<std::size_t>(kFrames)) << folder;
    EXPECT_EQ(s.pairs[5].stamp.ns(), kStart + 5 * kStep);
    EXPECT_EQ(s.pairs[2].file[1], "image_01/data/0000000002.png");
    EXPECT_EQ(s.calibration.intrinsics[0].distortion,
              (std::array<double, 5>{-0.3, 0.1, 0.001, 0.002, -0.05}));
    EXPECT_EQ(s.calibration.intrinsics[0].width, test::kTinyWidth);
    EXPECT_NEAR(s.calibration.T_camera_left[1].t.x(), -0.5, 1e-12);
    EXPECT_TRUE(s.remarks.empty()) << s.remarks[0];
  }
  // A drive that is a link takes the calibration beside the link, or else that of the drive.
  fs::create_directories(f / "elsewhere");
  const fs::path link = f / "elsewhere/2011_09_26_drive_0001_extract";
  fs::create_directory_symlink(f / kDrive, link);
  EXPECT_EQ(open_sequence(SequenceFormat::kitti_raw, link).calibration.intrinsics[0].cx, 35);
  std::string text = cameras_text();
  f.write("elsewhere/calib_cam_to_cam.txt", text.replace(text.find("60 0 35"), 7, "60 0 36"));
  EXPECT_EQ(open_sequence(SequenceFormat::kitti_raw, link).calibration.intrinsics[0].cx, 36);
}

TEST(KittiRaw, usesCalibrationOfSelectedCameras) {
  const test::TemporaryFolder f;
  write_drive(f);
  write_images(f, 64, 40);
  const StereoSequence s = open(f);
  EXPECT_FALSE(s.calibration.intrinsics[0].has_distortion());
  EXPECT_EQ(s.calibration.intrinsics[1].fx, 50);
  EXPECT_EQ(s.calibration.T_camera_left[1].R, Mat3::Identity());
  EXPECT_NEAR(s.calibration.T_camera_left[1].t.x(), -0.5, 1e-12);
  write_drive(f);
  for (const char* camera : {"0", "1"})
    fs::rename(f / (kDrive + "/image_0" + camera),
               f / (kDrive + "/image_0" + std::to_string(camera[0] - '0' + 2)));
  EXPECT_NEAR(open(f, {2, 3}).calibration.T_camera_left[1].t.x(), -0.56, 1e-12);
  // The left one is 6 cm to the left of camera 00.
  EXPECT_NEAR(
      read_recorded_ins(SequenceFormat::kitti_raw, f / kDrive, {2, 3}, true).T_ins_left->t.y(),
      -0.32 + 0.06, 1e-9);
}

/// Edit of a whole drive and its result: pairs that have both images, or a refusal.
struct Spoilt {
  const char* what;
  std::function<void(const test::TemporaryFolder&)> spoil;
  std::size_t whole = 0;
  const char* said = "";
};

TEST(KittiRaw, missingFilesSkipTheirFrames) {
  using Folder = test::TemporaryFolder;
  const auto text = [](const std::string& name, const std::string& content) {
    return [=](const Folder& f) { f.write(name, content); };
  };
  const auto calibration = [](const std::string& from, const std::string& to) {
    return [=](const Folder& f) { replace(f, kCameras, from, to); };
  };
  const std::vector<Spoilt> cases{
      {"the right camera missed frame 2, and its files are numbered on",
       [](const Folder& f) {
         for (int i = 2; i + 1 < kFrames; ++i)
           fs::rename(f / image_name(1, i + 1), f / image_name(1, i));
         f.write(times_name(1),
                 stamps(2, kStep, -1'300'000) + stamps(3, kStep, 3 * kStep - 1'300'000));
       },
       5},
      {"a list that is shorter", text(times_name(0), stamps(3, kStep, 0)), 3,
       "3 images have no line"},
      {"a list that is longer", text(times_name(1), stamps(9, kStep, -1'300'000)), 6,
       "3 lines follow"},
      {"an image is missing", [](const Folder& f) { fs::remove(f / image_name(1, 3)); }, 5},
      {"a stamp leaps ahead",
       text(times_name(0),
            stamps(2, kStep, 0) + stamp_line(20 * kStep) + stamps(3, kStep, 3 * kStep)),
       5},
      {"a stamp goes back",
       text(times_name(1),
            stamps(2, kStep, 0) + stamp_line(-20 * kStep) + stamps(3, kStep, 3 * kStep)),
       5},
      {"stray files",
       [](const Folder& f) {
         f.write(kDrive + "/image_00/data/._0000000000.png", "x");
         f.write(kDrive + "/image_00/data/thumbnail.png", "x");
       },
       6, "1 images have no number"},
      {"another size", [](const Folder& f) { write_images(f, 80, 40); }, 0,
       "for images of 70x48 pixels, or 64x40 rectified"},
      {"an empty list", text(times_name(0), ""), 0, "timestamps.txt: holds no times"},
      {"a list of words", text(times_name(0), stamp_line(0) + "soon\n"), 0, "timestamps.txt:2: "},
      {"another day", text(times_name(1), "2012-01-01 00:00:00.0\n"), 0, "no stamp close"},
      {"numbers missing", calibration("D_01: -0.3 0.1 0.001", "D_01: -0.3"), 0,
       "calib_cam_to_cam.txt:12: D_01: has 3 numbers instead of 5"},
      {"a key missing", calibration("R_01:", "Q_01:"), 0, "has no line `R_01:` with 9 numbers"},
      {"no number", calibration("R_01: 1 0", "R_01: 1 x"), 0, "calib_cam_to_cam.txt:13: R_01: `x`"},
      {"not a rotation", calibration("R_01: 1 0", "R_01: 1 2"), 0, "R_01: is not a rotation"},
      {"no calibration", [](const Folder& f) { fs::remove(f / kCameras); }, 0,
       "calib_cam_to_cam.txt: is missing"},
      {"no list", [](const Folder& f) { fs::remove(f / times_name(1)); }, 0,
       "image_01/timestamps.txt: cannot be opened"},
      {"no camera", [](const Folder& f) { fs::remove_all(f / (kDrive + "/image_01")); }, 0,
       "image_01"},
  };
  for (const Spoilt& c : cases) {
    const test::TemporaryFolder f;
    write_drive(f);
    c.spoil(f);
    StereoSequence s;
    const std::string refused = refusal_of([&] { s = open(f); });
    EXPECT_EQ(refused.empty(), c.whole > 0) << c.what << ": " << refused;
    EXPECT_TRUE(test::mentions(refused + joined(s.remarks), c.said))
        << c.what << ": " << refused << joined(s.remarks);
    std::size_t whole = 0;
    for (const StereoPair& pair : s.pairs)
      whole += pair.in_order && !pair.file[0].empty() && !pair.file[1].empty() ? 1 : 0;
    EXPECT_EQ(whole, c.whole) << c.what;
  }
  const test::TemporaryFolder f;
  write_drive(f);
  EXPECT_TRUE(test::mentions(refusal_of([&] { (void)open(f, {2, 2}); }), "are both camera 2"));
  fs::create_directories(f / "2011_09_26/2011_09_26_drive_0002_extract/oxts");
  EXPECT_TRUE(test::mentions(
      refusal_of([&] { (void)open_sequence(SequenceFormat::kitti_raw, f / "2011_09_26"); }),
      "holds 2 drives (2011_09_26_drive_0001_extract, "));
}

TEST(KittiRaw, stampsAreUtcNanoseconds) {
  EXPECT_EQ(parse_iso_time("2011-09-26 14:05:35.500923136")->ns(), kStart);
  EXPECT_EQ(parse_iso_time("2012-02-29 00:00:00")->ns(), 1'330'473'600'000'000'000);
  EXPECT_EQ(parse_iso_time("1970-01-01 00:00:00.1")->ns(), 100'000'000);
  for (const char* wrong : {"", "2011-09-26", "2011-02-30 00:00:00", "2011-09-26 24:00:00",
                            "2011-09-26 14:05:35.", "2011-09-26 14:05:35.5e3", "2011-09-26 14:05:3",
                            "2011-09-26 14:05:35 x", "-011-09-26 14:05:35"})
    EXPECT_FALSE(parse_iso_time(wrong)) << wrong;
}

// ---- INS

Mat3 rotation_of(const InsSample& s) {
  return Eigen::Quaterniond(s.q_enu_ins.data()).toRotationMatrix();
}

TEST(KittiRawIns, convertsPacketsToEnuWithMount) {
  const test::TemporaryFolder f;
  write_drive(f);
  // The record that three public sources quote of this data set, with what the development kit
  // makes of its angles.
  f.write(
      oxts_name(0),
      "49.011212804408 8.4228850417969 112.83492279053 0.022447 1e-05 -1.2219096732051 "
      "-3.3256321640686 1.1384311814592 3.5147680214713 0.037625160413037 -0.03878884255623 0 0 "
      "0 0 0 0 0 0 0 0 0 0 0.05 0.03 4 8 5 5 5\n");
  const RecordedIns recorded = ins(f);
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
  const Mat3 R = rotation_of(s);
  EXPECT_NEAR(R(1, 0), std::cos(0.01), 1e-9);
  EXPECT_NEAR(R(2, 0), std::sin(0.01), 1e-9);
  EXPECT_NEAR(R(0, 1), -std::cos(0.02), 1e-9);
  EXPECT_NEAR(R(2, 1), std::sin(0.02) * std::cos(0.01), 1e-9);
  Mat3 expected;
  expected << 0.341851747899, 0.939517225418, -0.021089466574, -0.939753894569, 0.341765416558,
      -0.007682296964, -0.000010000000, 0.022445114993, 0.999748076624;
  EXPECT_LT((rotation_of(recorded.readings[0].sample) - expected).cwiseAbs().maxCoeff(), 1e-9);
  // Camera 00 is 0.27 m ahead of the laser scanner's centre and 0.08 m above it; the scanner 0.81 m
  // ahead of the INS, 0.32 m to its right, 0.8 m above.
  EXPECT_LT((recorded.T_ins_left->t - Vec3(0.81 + 0.27, -0.32, 0.8 - 0.08)).norm(), 1e-9);
  EXPECT_LT(boresight_of(recorded.T_ins_left->R).norm(), 1e-9);
  EXPECT_FALSE(read_recorded_ins(SequenceFormat::kitti_raw, f / kDrive, {0, 1}, false).T_ins_left);
}

TEST(KittiRawIns, reportsBadPackets) {
  const test::TemporaryFolder f;
  write_drive(f);
  fs::remove(f / oxts_name(2));
  f.write(oxts_name(4), packet(4).substr(0, 90));
  f.write(oxts_name(5), "");
  f.write(kDrive + "/oxts/timestamps.txt",
          stamps(7, kStep / 2, 3'000'000) + stamp_line(0) + stamps(2, kStep / 2, 8 * kStep / 2));
  RecordedIns recorded = ins(f);
  EXPECT_EQ(recorded.readings.size(), 6U);
  for (std::size_t i = 1; i < recorded.readings.size(); ++i)
    EXPECT_LT(recorded.readings[i - 1].sample.stamp, recorded.readings[i].sample.stamp);
  for (const char* said : {"1 packets are missing; the first is 0000000002.txt",
                           "2 packets do not have 30 numbers", "1 stamps do not increase"})
    EXPECT_TRUE(test::mentions(joined(recorded.remarks), said)) << said;

  write_drive(f);
  struct Status {
    /// Navigation status, number of satellites, and modes.
    const char* words;
    FixStatus fix;
  };
  const std::array statuses{
      Status{"0 8 4 4 0", FixStatus::none}, Status{"4 0 4 4 0", FixStatus::dead_reckoning},
      Status{"4 8 0 0 0", FixStatus::dead_reckoning},
      Status{"4 8 11 11 0", FixStatus::dead_reckoning}, Status{"4 -1 6 6 6", FixStatus::fix_3d}};
  for (std::size_t i = 0; i < statuses.size(); ++i)
    f.write(oxts_name(static_cast<int>(i)), packet(1, statuses[i].words));
  recorded = ins(f);
  for (std::size_t i = 0; i < statuses.size(); ++i)
    EXPECT_EQ(recorded.readings[i].sample.fix, statuses[i].fix) << statuses[i].words;
  EXPECT_TRUE(test::mentions(joined(recorded.remarks), "4 of 10 packets have no satellite fix"));

  const auto refused = [&] { return refusal_of([&] { (void)ins(f); }); };
  replace(f, kImu, "R: 1 0 0", "R: 1 0.1 0");
  EXPECT_TRUE(test::mentions(refused(), "calib_imu_to_velo.txt:2: R: is not a rotation"));
  fs::remove(f / kImu);
  EXPECT_TRUE(test::mentions(refused(), "calib_imu_to_velo.txt: is missing"));
  for (int i = 0; i < kPackets; ++i) f.write(oxts_name(i), "1 2 3\n");
  EXPECT_TRUE(test::mentions(refused(), "0000000000.txt: is not an OXTS packet"));
  fs::remove_all(f / (kDrive + "/oxts/data"));
  EXPECT_TRUE(test::mentions(refused(), "oxts/data: does not exist"));
  fs::remove_all(f / (kDrive + "/oxts"));
  EXPECT_TRUE(ins(f).readings.empty());
}

}  // namespace
}  // namespace vergence::app
