#include "app/calibration/conversion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/calibration/conversion_references.hpp"

namespace vergence::app {
namespace {

using namespace test;

TEST(Conversion, everyFormatToEveryOtherAndBackIsTheSameRig) {
  const test::TemporaryFolder folder;
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind);
    const std::array<std::pair<CalibrationFormat, std::string>, 4> kOuts{
        {{CalibrationFormat::vergence, (folder / "c.yaml").string()},
         {CalibrationFormat::kalibr, (folder / "camchain.yaml").string()},
         {CalibrationFormat::ros, (folder / "ros").string() + "/"},
         {CalibrationFormat::opencv, (folder / "stereo.yml").string()}}};
    for (const auto& [first, in] : kOuts) {
      Remarks remarks;
      write_any_calibration(in, first, c, &remarks);
      EXPECT_EQ(format_of_name(in), first);
      for (const auto& [second, out] : kOuts) {
        if (first == second) continue;
        (void)convert_calibration({in, out, std::nullopt, std::nullopt});
        expect_same(c, read_any_calibration(out, std::nullopt, &remarks));
      }
    }
  }
  // Two files with a comma.
  Remarks remarks;
  const std::string pair = (folder / "a.yaml").string() + "," + (folder / "b.yaml").string();
  write_any_calibration(pair, CalibrationFormat::ros, ours(kModels[0]), &remarks);
  expect_same(ours(kModels[0]), read_any_calibration(pair, std::nullopt, &remarks));
}

/// One sentence that names the file and the key.
std::string last_error(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Conversion, spoiltFilesAreRefusedWithFileAndKey) {
  Remarks none;
  const auto [left, right] = format_ros(ours(kModels[0]), &none);
  const auto parts = format_opencv(ours(kModels[0]), &none);
  const std::string opencv = "%YAML:1.0\n---\n" + parts[0] + parts[1];
  struct Case {
    std::string text, second, key;
  };
  const std::vector<Case> cases{
      {"", "", "is empty"},
      {"just words", "", "is not a group of keys"},
      {"a: [1, 2", "", "is not YAML"},
      {"a: 1", "", "the lens of a second camera is missing"},
      {replaced(kCamchain, "camera_model: pinhole", "camera_model: omni"), "",
       "cam0.camera_model is \"omni\""},
      {replaced(kCamchain, "distortion_model: radtan", "distortion_model: fov"), "",
       "cam0.distortion_model is \"fov\""},
      {replaced(kCamchain, "[458.654, 457.296, 367.215, 248.375]",
                "[458.654, .nan, 367.215, 248.375]"),
       "", "cam0.intrinsics"},
      {replaced(kCamchain, "[458.654, 457.296, 367.215, 248.375]",
                "[458.654, 1e308, 367.215, 248.375]"),
       "", "cameras.0.intrinsics"},
      {replaced(kCamchain, "[458.654, 457.296, 367.215, 248.375]", "[458.654, 457.296]"), "",
       "cam0.intrinsics has 2 numbers"},
      {replaced(kCamchain, "[752, 480]", "[752]"), "", "cam0.resolution"},
      {replaced(kCamchain, "[752, 480]", "[99999999999, 480]"), "", "cam0.resolution"},
      {replaced(kCamchain, "  T_cn_cnm1:", "  T_unknown:"), "", "T_cn_cnm1 of cam1"},
      {replaced(kCamchain, "[0.9999972564,", "[0.5,"), "", "not orthonormal"},
      {replaced(kCamchain, "-0.1100738084", "-110.0738084"), "", "m from the left one"},
      {"cam0: {camera_model: pinhole}", "", "the lens of a second camera is missing"},
      {"cam0: 7", "", "the lens of a second camera is missing"},
      {left, "", "the lens of a second camera is missing"},
      {left, replaced(right, "image_width: 640", "image_width: many"), "image_width is \"many\""},
      {left, replaced(right, "camera_matrix:", "camera_thing:"),
       "the lens of a second camera is missing"},
      {left, replaced(right, "rows: 3", "rows: 4"), "camera_matrix.data is not a list"},
      {left, replaced(right, "plumb_bob", "thin_prism"), "distortion_model is \"thin_prism\""},
      {left, left, "has no baseline"},
      {replaced(opencv, "M2:", "X2:"), "", "the lens of a second camera is missing"},
      {replaced(opencv, "T:", "X:"), "",
       "the translation of camera 2 from camera 1 (T) is missing"},
      {replaced(opencv, "image_width: 640\n", ""), "", "--size"},
      {replaced(opencv, "fisheye_model: 0", "fisheye_model: 7"), "", "fisheye_model is 7"},
  };
  const test::TemporaryFolder folder;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    std::string in = folder.write("in.yaml", cases[i].text).string();
    if (!cases[i].second.empty()) in += "," + folder.write("second.yaml", cases[i].second).string();
    const std::string said =
        last_error([&] { (void)read_any_calibration(in, std::nullopt, &none); });
    EXPECT_NE(said.find(cases[i].key), std::string::npos) << "case " << i << " said: " << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    EXPECT_NE(said.find(folder.path().string()), std::string::npos) << "which file: " << said;
  }
  EXPECT_THROW((void)read_any_calibration((folder / "none").string(), std::nullopt, &none),
               InputError);
}

TEST(Conversion, rationalLensesAreRefusedUnlessTheyAreNone) {
  Remarks none;
  const auto parts = format_opencv(ours(kModels[0]), &none);
  const std::string more =
      replaced(replaced(parts[0], "cols: 5", "cols: 8"), "-0.0005, 0]", "-0.0005, 0, 0, 0, 0.02]") +
      parts[1];
  const std::string said = last_error([&] {
    (void)parse_any_calibration({{"m.yml", more}}, std::nullopt, &none);
  });
  EXPECT_NE(said.find("D1 has k4 to k6 of a rational polynomial"), std::string::npos) << said;
}

TEST(Conversion, aFileWithSomeBytesChangedIsReadOrRefusedAndNothingElse) {
  Remarks none;
  const auto [left, right] = format_ros(ours(kModels[0]), &none);
  const auto parts = format_opencv(ours(kModels[1]), &none);
  const test::TemporaryFolder folder;
  const std::string second = folder.write("right.yaml", right).string();
  Random random(77);
  int refused = 0;
  for (int run = 0; run < 300; ++run) {
    std::string text = run % 3 == 0   ? kCamchain
                       : run % 3 == 1 ? left
                                      : "%YAML:1.0\n---\n" + parts[0] + parts[1];
    for (int i = 0; i < 4; ++i)
      text[random.below(static_cast<std::uint32_t>(text.size()))] =
          static_cast<char>(random.below(256));
    if (run % 5 == 0) text.resize(random.below(static_cast<std::uint32_t>(text.size())));
    std::string in = folder.write("in.yaml", text).string();
    if (run % 3 == 1) in += "," + second;
    if (!last_error([&] { (void)read_any_calibration(in, std::nullopt, &none); }).empty())
      ++refused;
  }
  EXPECT_GT(refused, 100);
}

TEST(Conversion, wordsOfTheCommandLineAreChecked) {
  EXPECT_EQ(parse_format("ros"), CalibrationFormat::ros);
  EXPECT_NE(last_error([] { (void)parse_format("kalbr"); }).find("did you mean \"kalibr\""),
            std::string::npos);
  EXPECT_EQ(parse_size("640x480"), (ImageSize{640, 480}));
  for (const char* bad : {"", "640", "640x", "x480", "640x-1", "640x480x3", "640*480"})
    EXPECT_THROW((void)parse_size(bad), InputError) << bad;
  EXPECT_THROW((void)format_of_name("calibration.txt"), InputError);
  EXPECT_EQ(format_of_name("intrinsics.yml,extrinsics.yml"), CalibrationFormat::opencv);
  EXPECT_EQ(format_of_name("l.yaml,r.yaml"), CalibrationFormat::ros);
}

}  // namespace
}  // namespace vergence::app
