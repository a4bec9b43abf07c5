#include "core/calibration/track_log.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/math/random.hpp"

namespace vergence::calibration {
namespace {

struct Log {
  Arena arena;
  TrackLog log;
  Log(std::size_t frames, std::size_t observations) : log(frames, observations, arena) {}
  /// A frame with as many observations; tracks are numbered 100 · frame + i.
  void frame(std::uint64_t number, std::uint32_t observations) {
    log.begin({.number = number,
               .T_left_world = {Mat3::Identity(), {0, 0, -static_cast<double>(number)}},
               .stereo = 7,
               .observations = {}});
    for (std::uint32_t i = 0; i < observations; ++i) {
      LoggedObservation s{.track = static_cast<std::uint32_t>(100 * number) + i, .cameras = 0b11};
      log.push(s);
    }
  }
};

void expect_frame(const LoggedFrame& f, std::uint64_t number, std::size_t observations) {
  EXPECT_EQ(f.number, number);
  EXPECT_EQ(f.T_left_world.t.z(), -static_cast<double>(number));
  EXPECT_EQ(f.stereo, 7);
  ASSERT_EQ(f.observations.size(), observations);
  for (std::size_t i = 0; i < observations; ++i)
    EXPECT_EQ(f.observations[i].track, 100 * number + i);
}

TEST(TrackLog, fullLogDropsItsOldestFrame) {
  Log l(4, 5);
  for (std::uint64_t n = 1; n <= 23; ++n) {
    l.frame(n, static_cast<std::uint32_t>(n % 6));
    const std::size_t size = std::min<std::size_t>(n, 4);
    ASSERT_EQ(l.log.size(), size);
    for (std::size_t i = 0; i < size; ++i) {
      const std::uint64_t number = n - size + 1 + i;
      expect_frame(l.log.frame(i), number, number % 6);
    }
  }
}

TEST(TrackLog, observationsBeyondTheCapacityAreLeftOut) {
  Log l(2, 3);
  l.frame(1, 8);
  l.frame(2, 4);
  l.frame(3, 3);
  expect_frame(l.log.frame(0), 2, 3);
  expect_frame(l.log.frame(1), 3, 3);
}

TEST(TrackLog, appendedFramesKeepTheirObservations) {
  Log from(4, 8), to(3, 5);
  for (std::uint64_t n = 1; n <= 4; ++n) from.frame(n, static_cast<std::uint32_t>(2 + 2 * n));
  for (std::size_t i = 0; i < 4; ++i) to.log.append(from.log.frame(i));
  ASSERT_EQ(to.log.size(), 3U);
  from.log.clear();
  for (std::size_t i = 0; i < 3; ++i) expect_frame(to.log.frame(i), i + 2, 5);
}

TEST(TrackLog, framesBeforeANumberAreDropped) {
  Log l(4, 2);
  // The ring has wrapped and holds frames 3 to 6.
  for (std::uint64_t n = 1; n <= 6; ++n) l.frame(n, 1);
  l.log.drop_before(3);
  EXPECT_EQ(l.log.size(), 4U);
  l.log.drop_before(5);
  ASSERT_EQ(l.log.size(), 2U);
  expect_frame(l.log.frame(0), 5, 1);
  for (std::uint64_t n = 7; n <= 9; ++n) l.frame(n, 2);
  ASSERT_EQ(l.log.size(), 4U);
  expect_frame(l.log.frame(0), 6, 1);
  expect_frame(l.log.frame(3), 9, 2);
  l.log.drop_before(1000);
  EXPECT_TRUE(l.log.empty());
  l.frame(1001, 1);
  ASSERT_EQ(l.log.size(), 1U);
  expect_frame(l.log.frame(0), 1001, 1);
  l.log.clear();
  EXPECT_TRUE(l.log.empty());
}

TEST(TrackLog, scaledWorldKeepsItsDirections) {
  Log l(3, 1);
  Random random(4);
  const Vec3 centre(1, -2, 3), p(4, 5, 40);
  constexpr double kFactor = 1.3;
  std::vector<Transform> left, right;
  for (std::uint64_t n = 0; n < 3; ++n) {
    LoggedFrame f;
    f.number = n;
    f.unlinked = n != 2;
    f.T_left_world = {exp_so3({random.normal(), random.normal(), random.normal()}),
                      {random.normal(), random.normal(), random.normal()}};
    f.T_camera_left[1] = {exp_so3({0.01, 0.02, 0.03}), {-0.7, 0.01, 0.02}};
    left.push_back(f.T_left_world);
    right.push_back(f.T_camera_left[1]);
    l.log.begin(f);
  }
  l.log.scale_about(centre, kFactor);
  const Vec3 grown = centre + kFactor * (p - centre);
  for (std::size_t i = 0; i < 3; ++i) {
    const LoggedFrame& f = l.log.frame(i);
    // A point of the grown world is in the same direction, by the factor further away.
    EXPECT_LT((f.T_left_world * grown - kFactor * (left[i] * p)).norm(), 1e-12);
    if (f.unlinked) {
      EXPECT_LT(
          (f.T_camera_left[1] * (f.T_left_world * grown) - kFactor * (right[i] * (left[i] * p)))
              .norm(),
          1e-12);
    } else {
      EXPECT_EQ(f.T_camera_left[1].t, right[i].t) << "a calibration in use keeps its length";
    }
  }
}

TEST(TrackLog, copyHasItsOwnNewestFrames) {
  Log from(5, 4);
  // The log holds frames 3 to 7.
  for (std::uint64_t n = 1; n <= 7; ++n) from.frame(n, 4);
  Log all(5, 4), fewer(3, 4), small(2, 3);
  fewer.frame(99, 1);
  all.log.copy(from.log);
  fewer.log.copy(from.log);
  small.log.copy(from.log);
  ASSERT_EQ(all.log.size(), 5U);
  ASSERT_EQ(fewer.log.size(), 3U) << "as many as it can hold";
  ASSERT_EQ(small.log.size(), 2U);
  // Later changes of the source do not affect the copies.
  for (std::uint64_t n = 8; n <= 12; ++n) from.frame(n, 1);
  for (std::size_t i = 0; i < 5; ++i) expect_frame(all.log.frame(i), 3 + i, 4);
  for (std::size_t i = 0; i < 3; ++i) expect_frame(fewer.log.frame(i), 5 + i, 4);
  for (std::size_t i = 0; i < 2; ++i) expect_frame(small.log.frame(i), 6 + i, 3);
  all.frame(50, 2);
  ASSERT_EQ(all.log.size(), 5U);
  expect_frame(all.log.frame(4), 50, 2);
  const Log nothing(1, 1);
  all.log.copy(nothing.log);
  EXPECT_TRUE(all.log.empty());
}

}  // namespace
}  // namespace vergence::calibration
