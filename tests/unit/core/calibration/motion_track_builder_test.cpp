#include "core/calibration/motion_track_builder.hpp"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "tests/support/feature_drive.hpp"

namespace vergence::test {
namespace {

using calibration::MonitorFrame;
using calibration::MotionTrackBuilder;
using calibration::StereoObservation;

struct Fed {
  Arena arena{MotionTrackBuilder::memory_needed(400)};
  MotionTrackBuilder feed{400, arena};
  FeatureDrive drive;
  std::vector<StereoObservation> observations;
  explicit Fed(const FeatureDriveOptions& o) : drive(o) {}
  MonitorFrame next() {
    drive.next();
    observations.clear();
    for (const FeatureTrack& t : drive.tracks())
      observations.push_back({t.left, t.right, t.sigma_px, t.id});
    return feed.next(drive.stamp(), drive.frame(), observations, drive.T_now_previous());
  }
};

TEST(MotionTrackBuilder, usesNoStretchOfATrackTwiceAndPairsTheRightObservations) {
  Fed fed({});
  struct Seen {
    Vec2 left, right;
  };
  std::map<std::pair<std::uint64_t, std::uint32_t>, Seen> seen;
  std::map<std::uint64_t, Transform> T_left_world;
  std::uint64_t last = 0;
  int looks = 0;
  for (int i = 0; i < 200; ++i) {
    const MonitorFrame f = fed.next();
    T_left_world[f.frame] = fed.drive.T_left_world();
    for (const StereoObservation& s : f.stereo) seen[{f.frame, s.track}] = {s.left, s.right};
    if (f.motion.empty()) continue;
    ++looks;
    EXPECT_GE(f.before, last);  // stretches may touch
    last = f.frame;
    const Transform T = T_left_world[f.frame] * T_left_world[f.before].inverse();
    EXPECT_LT((T.t - f.T_now_before.t).norm(), 1e-9);
    EXPECT_LT((T.R - f.T_now_before.R).norm(), 1e-9);
    if (f.before > 0) {
      const Transform earlier = T_left_world[f.before] * T_left_world[f.before - 1].inverse();
      EXPECT_LT((earlier.t - f.T_before_earlier.t).norm(), 1e-9);
    }
    for (const calibration::MotionTrack& t : f.motion) {
      EXPECT_EQ(t.left_before, (seen[{f.before, t.track}].left));
      EXPECT_EQ(t.right_before, (seen[{f.before, t.track}].right));
      EXPECT_EQ(t.left_now, (seen[{f.frame, t.track}].left));
    }
  }
  EXPECT_GT(looks, 15);
}

TEST(MotionTrackBuilder, makesNoLookWhileTheCameraStands) {
  FeatureDriveOptions o;
  o.speed = 0;
  Fed fed(o);
  for (int i = 0; i < 100; ++i) {
    const MonitorFrame f = fed.next();
    EXPECT_FALSE(f.moving);
    EXPECT_TRUE(f.motion.empty());
  }
}

TEST(MotionTrackBuilder, leavesOutWhatItHasNoRoomFor) {
  Arena arena(MotionTrackBuilder::memory_needed(20));
  MotionTrackBuilder feed(20, arena);
  FeatureDrive drive({});
  std::vector<StereoObservation> observations;
  std::size_t most = 0;
  for (int i = 0; i < 60; ++i) {
    drive.next();
    observations.clear();
    for (const FeatureTrack& t : drive.tracks())
      observations.push_back({t.left, t.right, t.sigma_px, t.id});
    const MonitorFrame f =
        feed.next(drive.stamp(), drive.frame(), observations, drive.T_now_previous());
    EXPECT_EQ(f.stereo.size(), observations.size());
    most = std::max(most, f.motion.size());
  }
  EXPECT_GT(most, 0U);
  EXPECT_LE(most, 20U);
}

}  // namespace
}  // namespace vergence::test
