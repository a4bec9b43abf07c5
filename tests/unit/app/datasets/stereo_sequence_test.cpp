#include "app/datasets/stereo_sequence.hpp"

#include <algorithm>

#include "tests/support/refusal.hpp"
#include "tests/unit/app/datasets/tiny_drive.hpp"

namespace vergence::app {
namespace {

using test::mentions;

std::string refusal(SequenceFormat format, const std::filesystem::path& folder) {
  return test::refusal_of([&] { (void)open_sequence(format, folder); });
}

class Sequence : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
};

TEST_F(Sequence, kittiReadsExactTimesAndBaseline) {
  test::write_tiny_kitti(folder_, 3);
  folder_.write("times.txt", "0.000000e+00\n1.044989e-01\n123456789.123456789\n");
  const auto s = open_sequence(SequenceFormat::kitti, folder_.path());
  ASSERT_EQ(s.pairs.size(), 3U);
  EXPECT_EQ(s.pairs[1].stamp.ns(), 104498900);
  EXPECT_EQ(s.pairs[2].stamp.ns(), 123456789123456789);
  EXPECT_EQ(s.pairs[2].file[1], "image_1/000002.png");
  EXPECT_EQ(s.calibration.intrinsics[1].width, test::kTinyWidth);
  EXPECT_DOUBLE_EQ(s.calibration.T_camera_left[1].t.x(), -0.5);
  EXPECT_DOUBLE_EQ(s.calibration.baseline, 0.5);
}

TEST_F(Sequence, refusalNamesFileAndProblem) {
  const std::string p0 = "P0: 60 0 35 0 0 60 24 0 0 0 1 0\n",
                    sensor = test::tiny_sensor_yaml("", 0.5, "\n"),
                    lens = "intrinsics: [60, 61, 35, 24]", size = "resolution: [70, 48]";
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = sensor;
    return changed.replace(changed.find(from), from.size(), to);
  };
  struct Bad {
    /// File that is written into a complete data set.
    const char* file;
    std::string text;
    /// Parts of the message.
    const char *one, *two, *three = "";
  };
  const char *list = "mav0/cam0/data.csv", *right = "mav0/cam1/sensor.yaml";
  for (const Bad& c : {
           Bad{"times.txt", "0\n0.1\n", "3 left images", "2 lines"},
           Bad{"times.txt", "0\n0.1\nnoon\n", "times.txt:3", "noon"},
           Bad{"calib.txt", p0, "calib.txt", "P1"},
           Bad{"calib.txt", p0 + "P1: 60 0 35 -30 0 60 24 0 0 0 1\n", "calib.txt:2",
               "instead of 12"},
           Bad{"calib.txt", p0 + "P1: 60 0 35 30 0 60 24 0 0 0 1 0\n", "calib.txt", "swapped"},
           Bad{"calib.txt", p0 + "P1: 60 0 35 nan 0 60 24 0 0 0 1 0\n", "calib.txt:2", "nan"},
           Bad{list, "#timestamp [ns],filename\n15,x.png\nnoon,y.png\n", "cam0/data.csv:3", "noon"},
           Bad{list, "15,../../secret.png\n", "cam0/data.csv:1", "secret"},
           Bad{list, "15,15.png\n", "cam1/data.csv", "no stamp close"},
           Bad{right, with("0.0, -1.0, 0.0,", "0.0, -1.01, 0.0,"), "cam1/sensor.yaml",
               "cameras.1.T_camera_left", "orthonormal"},
           Bad{right, with("radial-tangential", "fov"), "cam1/sensor.yaml", "fov"},
           Bad{right, with(lens, "intrinsics: [60, 61, 35]"), "cam1/sensor.yaml", "intrinsics",
               "fx fy cx cy"},
           Bad{right, with(lens, "intrinsics: {a: b}"), "cam1/sensor.yaml", "camera matrix",
               "missing"},
           Bad{right, with(size, "resolution: [1e30, 48]"), "cam1/sensor.yaml", "resolution"},
           Bad{right, with(size, "resolution: [80, 48]"), "sensor.yaml", "80x48", "one size"},
       }) {
    const test::TemporaryFolder folder;
    const bool euroc = std::string_view(c.file).starts_with("mav0");
    if (euroc)
      test::write_tiny_euroc(folder, 3);
    else
      test::write_tiny_kitti(folder, 3);
    folder.write(c.file, c.text);
    const std::string said =
        refusal(euroc ? SequenceFormat::euroc : SequenceFormat::kitti, folder.path());
    EXPECT_TRUE(mentions(said, c.one, c.two, c.three)) << c.text;
  }
  EXPECT_TRUE(mentions(refusal(SequenceFormat::kitti, folder_ / "nowhere"), "does not exist"));
  for (const auto& [format, name] :
       {std::pair(SequenceFormat::kitti, "image_0"), std::pair(SequenceFormat::euroc, "cam0"),
        std::pair(SequenceFormat::folder, "left")})
    EXPECT_TRUE(mentions(refusal(format, folder_.path()), name));
  std::filesystem::create_directories(folder_ / "left");
  EXPECT_TRUE(mentions(refusal(SequenceFormat::folder, folder_.path()), "left", "no PNG, JPEG"));
}

TEST_F(Sequence, eurocReadsExactStampsAndExtrinsics) {
  for (const auto& [end, first] : {std::pair{"\n", ""}, std::pair{"\r\n", "%YAML:1.0\n"}}) {
    const test::TemporaryFolder folder;
    test::write_tiny_euroc(folder, 3, end, first);
    for (const char* below : {"", "mav0"}) {
      const auto s = open_sequence(SequenceFormat::euroc, folder / below);
      ASSERT_EQ(s.pairs.size(), 3U);
      EXPECT_EQ(s.pairs[1].stamp.ns(), test::kTinyStart + test::kTinyStep);
      EXPECT_EQ(s.pairs[1].file[0], "cam0/data/1403636584813555456.png");
      // Camera 1 is 0.5 m along the body's y axis, which is the camera's x axis: in camera 1 the
      // left camera lies at −0.5.
      EXPECT_NEAR((s.calibration.T_camera_left[1].t - Vec3(-0.5, 0, 0)).norm(), 0, 1e-15);
      EXPECT_NEAR((s.calibration.T_camera_left[1].R - Mat3::Identity()).norm(), 0, 1e-15);
      EXPECT_EQ(s.calibration.intrinsics[0].distortion[3], -0.002);
      EXPECT_EQ(s.calibration.intrinsics[1].fy, 61);
    }
  }
}

TEST_F(Sequence, eurocLeavesOutUnpairedImages) {
  test::write_tiny_euroc(folder_, 3);
  const auto line = [](std::int64_t stamp) { return fmt::format("{0},{0}.png\n", stamp); };
  folder_.write("mav0/cam1/data.csv", line(test::kTinyStart) + line(test::kTinyStart + 7) +
                                          line(test::kTinyStart + 2 * test::kTinyStep));
  const auto s = open_sequence(SequenceFormat::euroc, folder_.path());
  ASSERT_EQ(s.pairs.size(), 2U);
  EXPECT_EQ(s.pairs[1].stamp.ns(), test::kTinyStart + 2 * test::kTinyStep);
  EXPECT_EQ(s.left_out, 2U);
  EXPECT_TRUE(mentions(s.remarks.at(0), "2 images have no partner"));
}

TEST_F(Sequence, folderReadsTimesWithImageNames) {
  test::write_tiny_folder(folder_, 4);
  folder_.write("times.txt",
                "# stamp,file\n0.0,000.png\n0.1,003.png\n0.2,001.png,002.png\n0.3,gone.png\n");
  const auto s = open_sequence(SequenceFormat::folder, folder_.path());
  ASSERT_EQ(s.pairs.size(), 4U);
  EXPECT_EQ(s.pairs[1].file[1], "right/003.png");
  EXPECT_EQ(s.pairs[2].file[0], "left/001.png");
  EXPECT_EQ(s.pairs[2].file[1], "right/002.png");
  EXPECT_EQ(s.pairs[3].file[0], "left/gone.png") << "a frame that is skipped when it comes";
  folder_.write("times.txt", "0.0,a.png\n0.1,b.png\n");
  EXPECT_TRUE(mentions(refusal(SequenceFormat::folder, folder_.path()), "times.txt", "left/a.png",
                       "left/000.png"));
}

/// times.txt of pairs that are `step` of the file's own units apart.
std::string times_of(const char* format, double step, int pairs) {
  std::string text;
  for (int i = 0; i < pairs; ++i) text += fmt::format(fmt::runtime(format), step * i) + "\n";
  return text;
}

TEST_F(Sequence, refusesImplausibleTimes) {
  test::write_tiny_folder(folder_, 5);
  const auto far = [](const char* stamp) {
    return std::string("1000000000\n1100000000\n1200000000\n1300000000\n") + stamp + "\n";
  };
  struct Times {
    std::string text;
    /// Parts of the refusal; empty if the times are accepted.
    const char *one = "", *two = "", *three = "";
  };
  for (const Times& c : {
           // Another unit; a gap is none.
           Times{times_of("{:.0f}", 104.0, 5), "check the unit of its times"},
           Times{times_of("{:.0f}", 999'999.0, 5), "check the unit of its times"},
           Times{times_of("{:.1f}", 10.5, 5), "check the unit of its times"},
           Times{times_of("{:.1f}", 5e7, 5), "check the unit of its times"},
           Times{times_of("{:.0f}", 5e6, 5)},
           Times{times_of("{:.0f}", 5e7, 5)},
           Times{times_of("{:.0f}", 1e9, 5)},
           Times{"0.0\n0.1\n0.2\n500.0\n500.1\n"},
           // Beyond any drive, before differences overflow; the last two are 337 years apart.
           Times{far("9223372036854775807"), "9223372036854775807", "1824 to 2116"},
           Times{far("-9223372036854775807"), "-9223372036854775807", "1824 to 2116"},
           Times{far("4611686018427387905"), "4611686018427387905", "1824 to 2116"},
           Times{"-5317300000000000000\n-5317299900000000000\n-5317299800000000000\n"
                 "5317300000000000000\n5317300100000000000\n",
                 "1824 to 2116"},
           Times{"-300000000\n-200000000\n-100000000\n0\n100000000\n"},
           // Backwards; one frame that goes back is skipped when it comes.
           Times{"0.5\n0.4\n0.3\n0.2\n0.1\n", "of 4 steps", "4 go back", "oldest first"},
           Times{"0.5\n0.5\n0.5\n0.5\n0.5\n", "4 of 4 repeat"},
           Times{"0.1\n0.2\n0.15\n0.3\n0.4\n"},
       }) {
    folder_.write("times.txt", c.text);
    const std::string said = refusal(SequenceFormat::folder, folder_.path());
    EXPECT_EQ(said.empty(), *c.one == '\0') << c.text << said;
    if (!said.empty()) {
      EXPECT_TRUE(mentions(said, "times.txt", c.one, c.two, c.three)) << c.text;
    }
  }
}

// With and without times: equal numbers of images on both sides are no proof of an order.
TEST_F(Sequence, folderPairsByNameWithMissingImages) {
  for (const bool times : {true, false}) {
    test::write_tiny_folder(folder_, 5);
    if (!times) std::filesystem::remove(folder_ / "times.txt");
    std::filesystem::remove(folder_ / "left/001.png");
    std::filesystem::remove(folder_ / "right/003.png");
    for (const std::size_t lost : {1U, 2U}) {
      if (lost == 2) std::filesystem::remove(folder_ / "right/004.png");
      const auto s = open_sequence(SequenceFormat::folder, folder_.path());
      ASSERT_EQ(s.pairs.size(), 5U) << times << lost;
      for (int i = 0; i < 5; ++i)
        for (int k = 0; k < 2; ++k)
          EXPECT_EQ(s.pairs[static_cast<std::size_t>(i)].file[static_cast<std::size_t>(k)],
                    test::folder_name(k, i));
    }
  }
}

TEST_F(Sequence, folderWithOtherNamesNeedsEqualCounts) {
  test::write_tiny_folder(folder_, 3);
  std::filesystem::remove(folder_ / "times.txt");
  for (int i = 0; i < 3; ++i)
    std::filesystem::rename(folder_ / test::folder_name(1, i),
                            folder_ / fmt::format("right/r{}.png", static_cast<char>('a' + i)));
  EXPECT_EQ(open_sequence(SequenceFormat::folder, folder_.path()).pairs.at(2).file[1],
            "right/rc.png");
  std::filesystem::remove(folder_ / "right/rb.png");
  EXPECT_TRUE(mentions(refusal(SequenceFormat::folder, folder_.path()),
                       "3 left images and 2 right ones", "stamp,left file,right file"));
}

/// All images of the tiny folder in 16 bits, their samples from 0 to `most`.
void make_deep(const test::TemporaryFolder& folder, int pairs, int most) {
  for (int i = 0; i < pairs; ++i)
    for (int k = 0; k < 2; ++k) {
      cv::Mat image(test::kTinyHeight, test::kTinyWidth, CV_16UC1);
      for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
          image.at<std::uint16_t>(y, x) =
              static_cast<std::uint16_t>(most * (x + y) / (image.rows + image.cols - 2));
      cv::imwrite((folder / test::folder_name(k, i)).string(), image);
    }
}

// A disk that was full, a shutter that was shut: they say nothing of the others.
TEST_F(Sequence, detectsEffectiveBitsFromSamples) {
  struct Case {
    /// Highest samples of the first pairs and of the last one.
    int most, last;
    int bits;
  };
  for (const Case& c : {Case{4095, 4095, 12}, Case{1000, 1000, 10}, Case{16383, 16383, 14},
                        Case{3000, 50000, 16}, Case{0, 4095, 12}, Case{0, 0, 16}}) {
    test::write_tiny_folder(folder_, 9);
    make_deep(folder_, 9, c.last);
    make_deep(folder_, 8, c.most);
    test::truncate_file(folder_ / test::folder_name(0, 0), 0.5);
    std::filesystem::remove(folder_ / test::folder_name(1, 8));
    const auto s = open_sequence(SequenceFormat::folder, folder_.path());
    EXPECT_EQ(s.deep_bits, c.bits) << c.most << ' ' << c.last;
    const auto said = [&](const std::string& remark) {
      return remark.find("16 bits per sample") != std::string::npos;
    };
    EXPECT_EQ(std::count_if(s.remarks.begin(), s.remarks.end(), said), c.bits < 16 ? 1 : 0);
  }
  test::write_tiny_folder(folder_, 9);
  EXPECT_EQ(open_sequence(SequenceFormat::folder, folder_.path()).deep_bits, 16)
      << "8-bit images have none";
}

TEST_F(Sequence, refusesOtherImageSizeOfMajority) {
  test::write_tiny_folder(folder_, 3);
  for (int k = 0; k < 2; ++k) test::write_tiny_image(folder_ / test::folder_name(k, 0), 0, 64, 48);
  EXPECT_TRUE(mentions(refusal(SequenceFormat::folder, folder_.path()), "left/000.png", "64x48",
                       "70x48", "calibration.yaml"));
  test::write_tiny_folder(folder_, 3);
  test::write_tiny_image(folder_ / "right/002.png", 0, 70, 50);
  const auto s = open_sequence(SequenceFormat::folder, folder_.path());
  EXPECT_EQ(test::refusal_of([&] { check_image_sizes(s, 0, 3); }), "") << "one costs its frame";
  EXPECT_EQ(test::refusal_of([&] { check_image_sizes(s, 99, 3); }), "");
}

}  // namespace
}  // namespace vergence::app
