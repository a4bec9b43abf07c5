#include "core/types/pose_sample.hpp"

#include <gtest/gtest.h>

#include "core/types/calibration.hpp"
#include "core/types/image.hpp"

namespace vergence {
namespace {

TEST(Words, areThoseOfTheFiles) {
  EXPECT_EQ(to_string(State::initialising), "initialising");
  EXPECT_EQ(to_string(State::stereo_odometry), "stereo_odometry");
  EXPECT_EQ(to_string(State::lost), "lost");
  EXPECT_EQ(to_string(PoseStatus::ok), "ok");
  EXPECT_EQ(to_string(PoseStatus::degraded), "degraded");
  EXPECT_EQ(to_string(Reason::none), "");
  EXPECT_EQ(to_string(Reason::image_dark), "image_dark");
  EXPECT_EQ(to_string(Reason::time_gap), "time_gap");
  EXPECT_EQ(to_string(Reason::recalibrating), "recalibrating");
  EXPECT_EQ(to_string(Stage::pyramid), "pyramid");
  EXPECT_EQ(static_cast<int>(Stage::window) + 1, kStages);
}

TEST(ImageView, findsPixelsAcrossAStride) {
  const std::uint8_t bytes[] = {1, 2, 3, 99, 4, 5, 6, 99};
  const ImageView image{bytes, 3, 2, 4};
  EXPECT_FALSE(image.empty());
  EXPECT_EQ(image.at(2, 0), 3);
  EXPECT_EQ(image.at(0, 1), 4);
  EXPECT_EQ(image.row(1)[2], 6);
  EXPECT_TRUE(ImageView{}.empty());
  EXPECT_TRUE((ImageView{bytes, 0, 2, 4}).empty());
}

TEST(Intrinsics, equidistantIsDistortedEvenWithoutCoefficients) {
  Intrinsics k;
  EXPECT_FALSE(k.has_distortion());
  k.distortion[4] = 1e-3;
  EXPECT_TRUE(k.has_distortion());
  k = {};
  k.kind = CameraModelKind::pinhole_equidistant;
  EXPECT_TRUE(k.has_distortion());
}

}  // namespace
}  // namespace vergence
