// A camera that gives the same image again and again while the rig drives on.
#include <gtest/gtest.h>

#include "tests/unit/core/estimator/corridor_drive.hpp"

namespace vergence {
namespace {

using namespace features::test;
using odometry::test::Corridor;

/// Camera `frozen` gives its image of frame 30 until frame 46: 0.8 s, 2.4 m.
class RepeatedImage : public testing::TestWithParam<std::size_t> {};

TEST_P(RepeatedImage, repeatedImageIsNotTakenForStandstill) {
  constexpr int kFrozen = 30, kGoesOn = 47, kLast = 60;
  test::CorridorDrive d;
  d.options.online = false;
  d.given = d.nominal = d.corridor.rig();
  d.begin();
  std::optional<Image> kept;
  int posed = 0;
  for (int i = 0; i < kLast; ++i) {
    RigFrame frame = d.corridor.frame(i);
    ImageView& image = frame.images[GetParam()];
    if (i == kFrozen) kept = copy_of(image);
    const bool repeated = i > kFrozen && i < kGoesOn;
    if (repeated) image = kept->view();
    const PoseSample s = d.give(frame);
    if (repeated) {
      EXPECT_NE(s.status, PoseStatus::ok) << i;
      EXPECT_EQ(s.reason, Reason::image_repeated) << i;
    }
    if (s.status == PoseStatus::lost) continue;
    ++posed;
    const Transform truth = Corridor::T_world_left(0).inverse() * Corridor::T_world_left(i);
    const double off = (s.T_world_left.t - truth.t).norm();
    const auto variance = [&](std::size_t at) { return static_cast<double>(s.covariance[at]); };
    const double sigma = std::sqrt(variance(0) + variance(6) + variance(11));
    EXPECT_LE(off, 4 * sigma) << i << ' ' << to_string(s.reason);
    // The left camera goes on by itself as both did together: odometry_unlinked_test derives it.
    if (GetParam() == 1) {
      EXPECT_LT(off, 0.025 + 0.01 * truth.t.norm()) << i;
    }
  }
  // The first new image after 2.4 m without images may have to be found again in the next one.
  EXPECT_GE(posed, kLast - 1);
}

INSTANTIATE_TEST_SUITE_P(OfEitherCamera, RepeatedImage, testing::Values(0U, 1U));

}  // namespace
}  // namespace vergence
