// The judge of every claim of "no wrong ok" is judged first.
#include "tests/support/honesty.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "core/math/random.hpp"
#include "core/math/so3.hpp"

namespace vergence::test {
namespace {

constexpr std::size_t kFrames = 100, kAt = 60;  // frames; where something goes wrong

/// Straight on, 20 frames a second, and poses that are a millimetre off.
struct Drive {
  app::Trajectory truth;
  std::vector<JudgedPose> poses;

  explicit Drive(double step_m = 0.5) {
    Random random(1, 1);
    for (std::size_t i = 0; i < kFrames; ++i) {
      const Stamp stamp(1'000'000'000 + 50'000'000 * static_cast<std::int64_t>(i));
      Transform T;
      T.t = {0, 0, step_m * static_cast<double>(i)};
      truth.push_back({stamp, T});
      T.t.x() += 1e-3 * random.normal();
      poses.push_back({stamp, PoseStatus::ok, T});
    }
  }
  /// From that frame on all poses are elsewhere.
  void displace(std::size_t from, const Transform& by) {
    for (std::size_t i = from; i < kFrames; ++i) poses[i].T_world_left = poses[i].T_world_left * by;
  }
};

Transform aside(double m) {
  Transform T;
  T.t.x() = m;
  return T;
}

Honesty judged(const Drive& d) {
  const Drive untouched;
  return judge_honesty(d.poses, normal_error_there(untouched.poses, untouched.truth), d.truth);
}

TEST(Honesty, ofTheUntouchedDriveIsWhole) {
  const Honesty h = judged(Drive());
  EXPECT_EQ(h.ok, static_cast<int>(kFrames));
  EXPECT_EQ(h.wrong, 0);
  EXPECT_EQ(h.wrong_over_all, 0);
  EXPECT_EQ(h.unjudged, 0);
  EXPECT_LT(h.most, kHonestyTimes);
}

TEST(Honesty, aLeapOfAnOkPoseIsWrongInEveryFrameWhoseMotionHasIt) {
  Drive d;
  d.displace(kAt, aside(0.1));
  const Honesty h = judged(d);
  EXPECT_EQ(h.wrong, static_cast<int>(kHonestyFrames));
  EXPECT_EQ(h.first_wrong, kAt);
}

TEST(Honesty, aLeapWhileDegradedIsNotClaimedButCountedOverAll) {
  Drive d;
  d.displace(kAt, aside(0.1));
  d.poses[kAt].status = PoseStatus::degraded;
  const Honesty h = judged(d);
  EXPECT_EQ(h.wrong, 0);
  EXPECT_EQ(h.wrong_over_all, static_cast<int>(kHonestyFrames) - 1);
}

TEST(Honesty, aLeapAcrossALostFrameIsNeither) {
  Drive d;
  d.displace(kAt, aside(0.1));
  d.poses[kAt - 1] = {d.poses[kAt - 1].stamp, PoseStatus::lost, {}};
  const Honesty h = judged(d);
  EXPECT_EQ(h.lost, 1);
  EXPECT_EQ(h.wrong, 0);
  EXPECT_EQ(h.wrong_over_all, 0);
}

// Of a rig that stands: on the way a turn shows in the place, too.
TEST(Honesty, aTurnThatIsNotTrueIsWrong) {
  for (const double share : {0.9, 1.1}) {
    Drive d(0);
    for (std::size_t i = kAt; i < kFrames; ++i)
      d.poses[i].T_world_left.R = exp_so3(Vec3(0, share * kHonestyTimes * kLeastNormalTurn, 0));
    EXPECT_EQ(judged(d).wrong, share > 1 ? static_cast<int>(kHonestyFrames) : 0);
  }
}

TEST(Honesty, okPosesAtTimesWithoutTruthAreCounted) {
  Drive d;
  for (std::size_t i = kAt; i < kFrames; ++i)
    d.poses[i].stamp = d.poses[i].stamp + Duration::milliseconds(20);
  EXPECT_EQ(judged(d).unjudged, static_cast<int>(kFrames - kAt));
}

// Lost poses are of no place: they must not make normal what is not.
TEST(Honesty, lostPosesOfTheUntouchedDriveAreNoErrors) {
  Drive untouched;
  const NormalErrors without = normal_errors(untouched.poses, untouched.truth);
  for (std::size_t i = 50; i < 55; ++i)
    untouched.poses[i] = {untouched.poses[i].stamp, PoseStatus::lost, {}};
  const NormalErrors with = normal_errors(untouched.poses, untouched.truth);
  for (std::size_t n = 1; n <= kLongestNormal; ++n)
    EXPECT_NEAR(with[n].way_m, without[n].way_m, 2e-4) << n;  // fewer motions; a lost one: metres
  const NormalError there = normal_error_there(untouched.poses, untouched.truth);
  EXPECT_LT(there(untouched.poses[51].stamp, untouched.poses[52].stamp).way_m, 3e-3);
}

// What is hard there is normal there, and nowhere else.
TEST(Honesty, aHardPlaceIsNormalOnlyAroundIt) {
  Drive untouched;
  for (std::size_t i = 25; i < 66; ++i)
    untouched.poses[i].T_world_left.t.y() += (i % 2 == 0 ? 0.02 : 0.0);
  const NormalError there = normal_error_there(untouched.poses, untouched.truth);
  const auto frame_to = [&](std::size_t i) {
    return there(untouched.poses[i - 1].stamp, untouched.poses[i].stamp).way_m;
  };
  EXPECT_GT(frame_to(45), 2 * frame_to(90));
}

// A drive that has every third pair moves three times as far from one to the next.
TEST(Honesty, whatIsNormalIsSoOverATimeNotOverFrames) {
  Drive untouched(0);
  for (std::size_t i = 0; i < kFrames; ++i)
    untouched.poses[i].T_world_left.t = {0, 1e-3 * static_cast<double>(i), 0};
  const NormalError there = normal_error_there(untouched.poses, untouched.truth);
  for (const std::size_t n : {std::size_t{1}, std::size_t{3}, kLongestNormal})
    EXPECT_NEAR(there(untouched.poses[0].stamp, untouched.poses[n].stamp).way_m,
                1e-3 * static_cast<double>(n), 1e-12);
  EXPECT_NEAR(there(untouched.poses[0].stamp, untouched.poses[0].stamp).way_m, 1e-3, 1e-12)
      << "never none: it is divided by";
}

}  // namespace
}  // namespace vergence::test
