#include "app/calibration/conversion.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "tests/unit/app/calibration/conversion_references.hpp"

namespace vergence::app {
namespace {

using namespace test;

/// By Kalibr's own words: X_cn = T_cn_cnm1 X_cn-1, one after the other.
std::vector<Reference> reference_of_camchain(const std::string& text) {
  const YAML::Node root = YAML::Load(text);
  std::vector<Reference> references;
  cv::Mat before = cv::Mat::eye(4, 4, CV_64F);
  for (int k = 0; root[fmt::format("cam{}", k)]; ++k) {
    const YAML::Node cam = root[fmt::format("cam{}", k)];
    if (k > 0) {
      cv::Mat step(4, 4, CV_64F);
      for (int i = 0; i < 16; ++i)
        step.at<double>(i / 4, i % 4) =
            cam["T_cn_cnm1"][static_cast<std::size_t>(i / 4)][static_cast<std::size_t>(i % 4)]
                .as<double>();
      before = step * before;
    }
    const auto f = cam["intrinsics"].as<std::vector<double>>();
    Reference r{diagonal(f[0], f[1], f[2], f[3]), cv::Mat::zeros(4, 1, CV_64F),
                before(cv::Rect(0, 0, 3, 3)).clone(), before(cv::Rect(3, 0, 1, 3)).clone(),
                cam["distortion_model"].as<std::string>() == "equidistant"};
    if (cam["distortion_model"].as<std::string>() != "none")
      r.D = matrix(cam["distortion_coeffs"], 4, 1);
    references.push_back(r);
  }
  return references;
}

TEST(Kalibr, aCamchainIsReadAsItsOwnDefinitionProjects) {
  Remarks remarks;
  const CalibrationFile c =
      parse_any_calibration({{"camchain.yaml", kCamchain}}, std::nullopt, &remarks);
  expect_same(c, reference_of_camchain(kCamchain));
  EXPECT_EQ(c.names[0], "left");
  EXPECT_EQ(c.names[1], "cam1");
  EXPECT_EQ(c.rig.intrinsics[1].width, 752);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].find("T_cam_imu"), std::string::npos);
}

TEST(Kalibr, whatIsWrittenProjectsAsOursAndReadsBack) {
  for (const auto kind : kModels) {
    const CalibrationFile c = ours(kind, 3);
    Remarks remarks;
    const std::string text = format_kalibr(c, &remarks);
    expect_same(c, reference_of_camchain(text));
    const CalibrationFile back =
        parse_any_calibration({{"camchain.yaml", text}}, std::nullopt, &remarks);
    expect_same(c, back);
    EXPECT_EQ(back.names[2], "bow");
    ASSERT_EQ(remarks.size(), 1U);
    EXPECT_NE(remarks[0].find("serials"), std::string::npos) << remarks[0];
  }
}

TEST(Kalibr, aThirdCoefficientOfRadiusHasNoPlaceAndIsNotDropped) {
  CalibrationFile c = ours(CameraModelKind::pinhole_radtan);
  c.rig.intrinsics[0].distortion[4] = 0.01;
  Remarks remarks;
  EXPECT_THROW((void)format_kalibr(c, &remarks), InputError);
}

}  // namespace
}  // namespace vergence::app
