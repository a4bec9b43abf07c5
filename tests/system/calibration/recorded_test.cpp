// Recorded excerpts with their own calibration, and with nothing but the baseline's length.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/so3.hpp"
#include "tests/support/recorded_sequence.hpp"
#include "tests/support/shared_data.hpp"

namespace vergence::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct Excerpt {
  const char* name;
  double ate_m;
};

class RecordedExcerpt : public testing::TestWithParam<Excerpt> {};

TEST_P(RecordedExcerpt, suppliedCalibrationIsUsableAndAccurate) {
  const auto d = open_recorded(GetParam().name);
  if (!d) GTEST_SKIP() << shared_data_missing("data/" + std::string(GetParam().name));
  const app::Configuration c = app::load_configuration(std::nullopt, {});
  const DriveOutcome o =
      drive_recorded(*d, d->sequence, c, app::replayed_calibration(c, d->sequence, false));
  EXPECT_LT(o.ate_m, GetParam().ate_m);
  EXPECT_TRUE(std::all_of(o.samples.begin(), o.samples.end(), [](const PoseSample& s) {
    return s.status == PoseStatus::ok || s.reason == Reason::unverified_calibration;
  }));
}

INSTANTIATE_TEST_SUITE_P(All, RecordedExcerpt,
                         testing::Values(Excerpt{"kitti06_51", 0.062},
                                         Excerpt{"euroc_mh01", 0.0048}),
                         [](const auto& excerpt) { return std::string(excerpt.param.name); });

TEST(RecordedFromScratch, eurocTransformIsFoundFromBaselineLength) {
  const auto d = open_recorded("euroc_mh01");
  if (!d) GTEST_SKIP() << shared_data_missing("data/euroc_mh01");
  const app::Configuration c = app::load_configuration(
      std::nullopt, {"calibration.intrinsics=fixed", "calibration.min_frames=45"});
  const auto published = app::replayed_calibration(c, d->sequence, false);
  const DriveOutcome scratch = drive_recorded(*d, d->sequence, c, blank(published));
  EXPECT_EQ(scratch.lost, 0);
  ASSERT_TRUE(scratch.rig && scratch.adopted > 0);
  const Transform &found = scratch.rig->T_camera_left[1],
                  &real = published.file.rig.T_camera_left[1];
  EXPECT_LT(log_so3(found.R * real.R.transpose()).norm() / kDegree, 0.08);
  EXPECT_LT(std::atan2(found.t.cross(real.t).norm(), found.t.dot(real.t)) / kDegree, 0.5);
  EXPECT_NEAR(found.t.norm(), 0.11007784, 1e-6);
  auto begin = published;
  begin.file.rig = *scratch.rig;
  const double found_m = drive_recorded(*d, d->sequence, c, begin).ate_m,
               published_m = drive_recorded(*d, d->sequence, c, published).ate_m;
  EXPECT_LT(found_m, published_m + 1e-3);
}

}  // namespace
}  // namespace vergence::test
