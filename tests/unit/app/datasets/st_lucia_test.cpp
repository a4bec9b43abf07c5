#include <numbers>

#include <fmt/format.h>
#include <GeographicLib/LocalCartesian.hpp>
#include <opencv2/imgcodecs.hpp>

#include "app/datasets/frame_decoder.hpp"
#include "core/math/random.hpp"
#include "core/types/bayer.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using test::mentions;
using test::refusal_of;

constexpr double kPi = std::numbers::pi;

enum class Velocity { east_north_up, north_east_down, north_west_up };
enum class Yaw { north_to_west, north_to_east, east_to_north };
/// Axis conventions of a log; by default those of the MTi-G.
struct Conventions {
  Velocity velocity = Velocity::north_west_up;
  Yaw yaw = Yaw::north_to_west;
  bool pitch_first = false, nose_up_positive = false;
};

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}
void write_mosaic(const std::filesystem::path& file, std::vector<std::uint8_t> pixels, int width,
                  int height) {
  ASSERT_TRUE(cv::imwrite(file.string(), cv::Mat(height, width, CV_8U, pixels.data())));
}

// ---- images

/// The width is no multiple of four, because BMP pads its rows.
constexpr int kWidth = 62, kHeight = 48;

std::vector<std::uint8_t> mosaic(std::uint64_t seed) {
  Random random(seed);
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (auto& v : pixels) v = static_cast<std::uint8_t>(random.below(256));
  return pixels;
}

class StLuciaImages : public testing::Test {
 protected:
  StLuciaImages() {
    std::filesystem::create_directories(folder_ / "101215_153851_MultiCamera0");
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < 2; ++k)
        write_mosaic(
            folder_ / fmt::format("101215_153851_MultiCamera0/cam{}_image{:05d}.bmp", k, i),
            mosaic(static_cast<std::uint64_t>(10 * i + k)), kWidth, kHeight);
    write(log_,
          "sec usec w h f sec usec w h f left right\n"
          "1292391531 1234 62 48 raw 1292391531 990 62 48 raw "
          "101215_153851_MultiCamera0/cam0_image00000.bmp cam1_image00000.bmp\n"
          "1292391531 34567 62 48 raw 1292391531 34570 62 48 raw cam0_image00001.bmp "
          "/data/x/cam1_image00001.bmp\n");
    CalibrationFile calibration;
    calibration.rig.cameras = 2;
    for (Intrinsics& lens : calibration.rig.intrinsics)
      lens = {.width = kWidth, .height = kHeight, .fx = 50, .fy = 50, .cx = 30, .cy = 23};
    calibration.rig.T_camera_left[1].t = {-0.75, 0, 0};
    write_calibration(calibration_, calibration);
  }
  [[nodiscard]] StereoSequence open() const {
    SequenceOptions options;
    options.calibration = {calibration_.string(), [this](const StereoSequence&) {
                             return read_calibration(calibration_);
                           }};
    return open_sequence(SequenceFormat::st_lucia, folder_.path(), options);
  }

  test::TemporaryFolder folder_;
  std::filesystem::path log_ = folder_ / "101215_153851_MultiCamera0.log",
                        calibration_ = folder_ / "calibration.yaml";
};

TEST_F(StLuciaImages, readsUnpaddedMicroseconds) {
  const StereoSequence s = open();
  ASSERT_EQ(s.pairs.size(), 2U);
  EXPECT_EQ(s.pairs[0].stamp.ns(), 1'292'391'531'001'234'000);
  EXPECT_EQ(s.pairs[1].stamp.ns(), 1'292'391'531'034'567'000);
  EXPECT_EQ(s.pairs[0].file[0], "101215_153851_MultiCamera0/cam0_image00000.bmp");
  EXPECT_EQ(s.pairs[0].file[1], "101215_153851_MultiCamera0/cam1_image00000.bmp");
  EXPECT_EQ(s.pairs[1].file[1], "101215_153851_MultiCamera0/cam1_image00001.bmp")
      << "the folder of another machine";
  EXPECT_TRUE(s.bayer);
}

TEST_F(StLuciaImages, convertsMosaicToGrey) {
  const StereoSequence s = open();
  Arena arena;
  FramePool pool(kWidth, kHeight, FrameDecoder::kSlots, arena);
  FrameDecoder decoder(s, 0, 2, pool);
  for (std::uint64_t i = 0; i < 2; ++i) {
    DecodedPair pair;
    ASSERT_TRUE(decoder.next(&pair));
    ASSERT_TRUE(pair.decoded) << pair.issue.data();
    for (std::size_t k = 0; k < 2; ++k) {
      std::vector<std::uint8_t> grey(kWidth * kHeight);
      bayer_to_grey(mosaic(10 * i + k).data(), kWidth, kWidth, kHeight, grey.data(), kWidth);
      const ImageView v = pool.view(pair.slots[k]);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
          ASSERT_EQ(v.at(x, y), grey[static_cast<std::size_t>(y * kWidth + x)]);
    }
    decoder.release(pair);
  }
}

TEST_F(StLuciaImages, usesPublishedCalibrationForItsSizeOnly) {
  const std::string said =
      refusal_of([&] { (void)open_sequence(SequenceFormat::st_lucia, folder_.path()); });
  EXPECT_TRUE(test::mentions(said, "62x48", "1024x768"));
  const std::vector<std::uint8_t> full(1024 * 768, 90);
  for (const char* name : {"cam0_image00000.bmp", "cam1_image00000.bmp"})
    write_mosaic(folder_ / "101215_153851_MultiCamera0" / name, full, 1024, 768);
  const StereoSequence s = open_sequence(SequenceFormat::st_lucia, folder_.path());
  EXPECT_NEAR(s.calibration.baseline, 0.750683, 1e-6);
  EXPECT_LT(s.calibration.T_camera_left[1].t.x(), 0) << "the right camera is on the right";
}

TEST_F(StLuciaImages, refusalNamesBrokenFolder) {
  write(log_, "1292391531 1234 62 48 raw 1292391531 990 62 48 raw cam0_image00000.bmp\n");
  EXPECT_TRUE(mentions(refusal_of([&] { (void)open(); }), "MultiCamera0.log:1:"));
  write(log_,
        "1292391531 1000000 62 48 raw 1292391531 990 62 48 raw cam0_image00000.bmp "
        "cam1_image00000.bmp\n");
  EXPECT_TRUE(mentions(refusal_of([&] { (void)open(); }), "below a million"));
  write(log_, "sec usec\n");
  EXPECT_TRUE(mentions(refusal_of([&] { (void)open(); }), "names no images"));
  write(folder_ / "101215_160000_MultiCamera0.log", "");
  EXPECT_TRUE(mentions(refusal_of([&] { (void)open(); }), "2 files"));
  std::filesystem::remove(folder_ / "101215_160000_MultiCamera0.log");
  std::filesystem::remove(log_);
  EXPECT_TRUE(
      mentions(refusal_of([&] { (void)open(); }), "holds no file that ends in _MultiCamera0.log"));
}

// ---- INS

/// An S-shaped way at 10 m/s over a hill, in enu at the first place; the vehicle points along it
/// and leans into its bends.
struct Way {
  static constexpr double kRate = 20, kSeconds = 40;
  static double yaw(double t) { return 0.4 + 0.9 * std::sin(0.3 * t); }
  static double pitch_up(double t) { return 0.05 * std::sin(0.5 * t); }
  static double roll(double t) { return 0.03 * std::cos(0.9 * t + 1); }
  static Vec3 velocity(double t) {
    return 10 * Vec3(std::cos(yaw(t)) * std::cos(pitch_up(t)),
                     std::sin(yaw(t)) * std::cos(pitch_up(t)), std::sin(pitch_up(t)));
  }
  static Mat3 R(double t) {
    return exp_so3(Vec3(0, 0, yaw(t))) * exp_so3(Vec3(0, -pitch_up(t), 0)) *
           exp_so3(Vec3(roll(t), 0, 0));
  }
};

std::vector<std::string> ins_lines(const Conventions& c, double speed = 1) {
  const GeographicLib::LocalCartesian plane(-27.4975, 153.0137, 60);
  std::vector<std::string> lines;
  Vec3 p = Vec3::Zero();
  for (int i = 0; i < static_cast<int>(Way::kRate * Way::kSeconds); ++i) {
    const double t = i / Way::kRate, dt = 1 / Way::kRate;
    double latitude = 0, longitude = 0, height = 0;
    plane.Reverse(p.x(), p.y(), p.z(), latitude, longitude, height);
    const Vec3 v = speed * Way::velocity(t);
    // The path is integrated by Simpson's rule.
    p +=
        dt / 6 * speed * (Way::velocity(t) + 4 * Way::velocity(t + dt / 2) + Way::velocity(t + dt));
    const Vec3 written = c.velocity == Velocity::east_north_up     ? v
                         : c.velocity == Velocity::north_east_down ? Vec3(v.y(), v.x(), -v.z())
                                                                   : Vec3(v.y(), -v.x(), v.z());
    const double yaw = c.yaw == Yaw::east_to_north   ? Way::yaw(t)
                       : c.yaw == Yaw::north_to_east ? kPi / 2 - Way::yaw(t)
                                                     : Way::yaw(t) - kPi / 2;
    const double pitch = c.nose_up_positive ? Way::pitch_up(t) : -Way::pitch_up(t),
                 roll = Way::roll(t);
    const int us = static_cast<int>(std::lround(t * 1e6));
    lines.push_back(
        fmt::format("{} {} {:.12f} {:.12f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}",
                    1292391531 + us / 1000000, us % 1000000, latitude, longitude, height,
                    height - 40, written.x(), written.y(), written.z(),
                    c.pitch_first ? pitch : roll, c.pitch_first ? roll : pitch, yaw));
  }
  return lines;
}

RecordedIns read(const std::vector<std::string>& lines) {
  const test::TemporaryFolder folder;
  write(folder / "101215_153851_Ins0.log", fmt::format("{}\n", fmt::join(lines, "\n")));
  return read_recorded_ins(SequenceFormat::st_lucia, folder.path(), {0, 1}, true);
}

std::string said(const RecordedIns& ins) { return fmt::format("{}", fmt::join(ins.remarks, "; ")); }

TEST(StLuciaIns, infersAxesFromMotion) {
  for (const Velocity velocity :
       {Velocity::east_north_up, Velocity::north_east_down, Velocity::north_west_up})
    for (const Yaw yaw : {Yaw::north_to_west, Yaw::north_to_east, Yaw::east_to_north})
      for (const bool pitch_first : {false, true})
        for (const bool nose_up : {false, true}) {
          SCOPED_TRACE(fmt::format("{} {} {} {}", static_cast<int>(velocity), static_cast<int>(yaw),
                                   pitch_first, nose_up));
          const RecordedIns ins = read(ins_lines({velocity, yaw, pitch_first, nose_up}));
          ASSERT_EQ(ins.readings.size(), 800U);
          const InsSample& s = ins.readings[333].sample;
          const double t = 333 / Way::kRate;
          const Mat3 R = Eigen::Quaterniond(s.q_enu_ins.data()).toRotationMatrix();
          EXPECT_LT(log_so3(R.transpose() * Way::R(t)).norm(), 1e-8);
          EXPECT_LT(
              (Vec3(s.velocity_enu[0], s.velocity_enu[1], s.velocity_enu[2]) - Way::velocity(t))
                  .norm(),
              1e-8);
          EXPECT_EQ(s.stamp.ns(), 1'292'391'531'000'000'000 + 333 * 50'000'000LL);
        }
}

/// Edit of a log's lines, expected message and number of remaining samples.
struct Log {
  const char* what;
  std::function<void(std::vector<std::string>*)> spoil;
  std::size_t readings;
  const char* said;
  double speed = 1;
};

TEST(StLuciaIns, repairsOrRefusesLogs) {
  using Lines = std::vector<std::string>;
  for (const Log& c : {
           Log{"shows nothing", [](Lines*) {}, 800, "too slow or too short", 0.3},
           Log{"out of order", [](Lines* l) { std::swap((*l)[100], (*l)[500]); }, 798,
               "2 samples of the INS have stamps that do not increase"},
           Log{"a stamp twice", [](Lines* l) { (*l)[200] = (*l)[199]; }, 799,
               "1 samples of the INS have stamps that do not increase"},
           Log{"a broken line", [](Lines* l) { (*l)[300] = "1292391546 0 -27.5"; }, 799,
               "1 lines that are not twelve numbers"},
           Log{"longitude first",
               [](Lines* l) {
                 for (std::string& line : *l) {
                   const std::size_t a = line.find(' ', line.find(' ') + 1) + 1,
                                     b = line.find(' ', a) + 1, d = line.find(' ', b);
                   line = line.substr(0, a) + line.substr(b, d - b) + " " +
                          line.substr(a, b - a - 1) + line.substr(d);
                 }
               },
               800, "longitude stands before latitude"},
           Log{"no log",
               [](Lines* l) {
                 *l = {"1 2 3", "4 5 6", "7 8 9"};
               },
               0, "Ins0.log:1: and 2 more lines"},
           Log{"no place", [](Lines* l) { *l = {"1292391531 0 -27.5 153 1e9 0 0 0 0 0 0 0"}; }, 0,
               "an invalid position"},
       }) {
    Lines lines = ins_lines({}, c.speed);
    c.spoil(&lines);
    RecordedIns ins;
    const std::string refused = refusal_of([&] { ins = read(lines); });
    EXPECT_TRUE(test::mentions(refused + said(ins), c.said)) << c.what << refused << said(ins);
    ASSERT_EQ(ins.readings.size(), c.readings) << c.what;
    for (std::size_t i = 1; i < ins.readings.size(); ++i)
      ASSERT_LT(ins.readings[i - 1].sample.stamp, ins.readings[i].sample.stamp);
    if (c.readings == 0) continue;
    EXPECT_NEAR(ins.readings[0].sample.position.latitude_deg, -27.4975, 1e-9) << c.what;
  }
  const test::TemporaryFolder empty;
  EXPECT_TRUE(
      test::mentions(said(read_recorded_ins(SequenceFormat::st_lucia, empty.path(), {0, 1}, true)),
                     "holds no file that ends in _Ins0.log"));
}

}  // namespace
}  // namespace vergence::app
