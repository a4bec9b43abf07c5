#include "app/calibration/conversion.hpp"

#include <gtest/gtest.h>

#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/calibration/conversion_references.hpp"

namespace vergence::app {
namespace {

using namespace test;

TEST(OpenCvStereo, whatIsWrittenIsReadByOpenCvAndProjectsAsOurs) {
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind);
    Remarks remarks;
    const auto parts = format_opencv(c, &remarks);
    const std::string text = "%YAML:1.0\n---\n" + parts[0] + parts[1];
    cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    Reference left{{},
                   {},
                   cv::Mat::eye(3, 3, CV_64F),
                   cv::Mat::zeros(3, 1, CV_64F),
                   kind == CameraModelKind::pinhole_equidistant};
    Reference right;
    right.fisheye = left.fisheye;
    file["M1"] >> left.K, file["D1"] >> left.D, file["M2"] >> right.K, file["D2"] >> right.D,
        file["R"] >> right.R, file["T"] >> right.t;
    expect_same(c, {left, right});
    expect_same(c, parse_any_calibration({{"stereo.yml", text}}, std::nullopt, &remarks));
  }
}

TEST(OpenCvStereo, whatOpenCvWritesIsReadAsItProjectsUnderEachOfItsNames) {
  const CalibrationFile truth = ours(CameraModelKind::pinhole_radtan);
  struct Names {
    const char *M1, *D1, *M2, *D2, *R, *T;
  };
  for (const Names& n :
       {Names{"M1", "D1", "M2", "D2", "R", "T"}, Names{"K1", "D1", "K2", "D2", "R", "T"},
        Names{"cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "R", "T"}}) {
    std::array<Reference, 2> references;
    for (std::size_t k = 0; k < 2; ++k) {
      const Intrinsics& lens = truth.rig.intrinsics[k];
      references[k].K = diagonal(lens.fx, lens.fy, lens.cx, lens.cy);
      references[k].D = cv::Mat::zeros(1, 14, CV_64F);
      for (int i = 0; i < 5; ++i)
        references[k].D.at<double>(i) = lens.distortion[static_cast<std::size_t>(i)];
      const Transform& T = truth.rig.T_camera_left[k];
      references[k].t = (cv::Mat_<double>(3, 1) << T.t.x(), T.t.y(), T.t.z());
      references[k].R = cv::Mat(3, 3, CV_64F);
      for (int i = 0; i < 9; ++i) references[k].R.at<double>(i / 3, i % 3) = T.R(i / 3, i % 3);
    }
    // As the sample does: lenses in one file, places in another.
    cv::FileStorage lenses("a.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY),
        places("b.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    lenses << n.M1 << references[0].K << n.D1 << references[0].D << n.M2 << references[1].K << n.D2
           << references[1].D;
    places << n.R << references[1].R << n.T << references[1].t;
    const std::vector<CalibrationText> files{{"intrinsics.yml", lenses.releaseAndGetString()},
                                             {"extrinsics.yml", places.releaseAndGetString()}};
    Remarks remarks;
    EXPECT_THROW((void)parse_any_calibration(files, std::nullopt, &remarks), InputError)
        << "no size";
    expect_same(parse_any_calibration(files, ImageSize{640, 480}, &remarks),
                {references[0], references[1]});
  }
}

/// As cv::fisheye::stereoCalibrate's answer is written: nothing but the count tells its D from that
/// of a lens with k1 k2 p1 p2, which is legal, too.
TEST(OpenCvStereo, fourCoefficientsThatMayBeOfAFisheyeLensAreSaid) {
  const std::string lens =
      "!!opencv-matrix {rows: 3, cols: 3, dt: d, data: [290, 0, 320, 0, 291, "
      "240, 0, 0, 1]}\n";
  const auto text = [&](const std::string& d, const std::string& more) {
    return "%YAML:1.0\n---\nM1: " + lens + "D1: " + d + "M2: " + lens + "D2: " + d +
           "R: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
           "T: {rows: 3, cols: 1, data: [-0.12, 0, 0]}\nimageSize: [640, 480]\n" +
           more;
  };
  const std::string four = "{rows: 4, cols: 1, data: [-0.02, 0.008, -0.004, 0.0008]}\n",
                    five = "{rows: 1, cols: 5, data: [-0.02, 0.008, -0.004, 0.0008, 0]}\n";
  const auto read = [](const std::string& yaml, Remarks* remarks) {
    return parse_any_calibration({{"stereo.yml", yaml}}, std::nullopt, remarks)
        .rig.intrinsics[1]
        .kind;
  };
  Remarks remarks;
  EXPECT_EQ(read(text(four, ""), &remarks), CameraModelKind::pinhole_radtan);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].find("stereo.yml: four distortion coefficients"), std::string::npos);
  EXPECT_NE(remarks[0].find("fisheye_model: 1"), std::string::npos) << remarks[0];

  remarks.clear();
  EXPECT_EQ(read(text(four, "fisheye_model: 1\n"), &remarks), CameraModelKind::pinhole_equidistant);
  EXPECT_EQ(read(text(four, "fisheye_model: 0\n"), &remarks), CameraModelKind::pinhole_radtan);
  EXPECT_EQ(read(text(five, ""), &remarks), CameraModelKind::pinhole_radtan);
  EXPECT_TRUE(remarks.empty()) << remarks[0];
}

}  // namespace
}  // namespace vergence::app
