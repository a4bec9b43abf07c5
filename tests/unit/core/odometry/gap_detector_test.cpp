#include "core/odometry/gap_detector.hpp"

#include <gtest/gtest.h>

namespace vergence::odometry {
namespace {

// Both are in s.
constexpr double kUsual = 0.05, kGap = 0.6;

/// Has seen frames an even `interval` apart, the last one at `last_`.
class Frames {
 public:
  GapDetector gaps;

  explicit Frames(double interval = kUsual) {
    for (int i = 0; i < 5; ++i) (void)next(interval);
  }
  /// Result for a frame `interval` seconds after the last one.
  double next(double interval, bool can_rebuild = true) {
    last_ = last_ + Duration::seconds(interval);
    (void)gaps.since_frame(last_);
    return gaps.check(interval, can_rebuild);
  }

 private:
  Stamp last_{1'000'000'000};
};

TEST(GapDetector, gapRequestsARenewalUntilReset) {
  Frames f;
  EXPECT_EQ(f.next(kUsual), 0);
  EXPECT_FALSE(f.gaps.rebuild_due());
  EXPECT_EQ(f.next(kGap), kGap);
  EXPECT_TRUE(f.gaps.rebuild_due());
  EXPECT_EQ(f.next(kUsual), 0);
  EXPECT_TRUE(f.gaps.rebuild_due());
  f.gaps.clear_rebuild();
  EXPECT_FALSE(f.gaps.rebuild_due());
}

TEST(GapDetector, evenIntervalsAreNoGap) {
  Frames f(1.0);
  EXPECT_FALSE(f.gaps.rebuild_due());
  for (int i = 0; i < 5; ++i) EXPECT_EQ(f.next(1.0), 0);
  EXPECT_EQ(f.next(2.0), 0) << "a frame that was lost";
  EXPECT_EQ(f.next(10.0), 10.0);
}

TEST(GapDetector, secondGapInARowRequestsNoRenewal) {
  Frames f;
  (void)f.next(kGap);
  // The map was rebuilt.
  f.gaps.clear_rebuild();
  EXPECT_EQ(f.next(kGap), kGap);
  EXPECT_FALSE(f.gaps.rebuild_due());
}

TEST(GapDetector, unlinkedCamerasNeedNoRenewal) {
  Frames f;
  EXPECT_EQ(f.next(kGap, false), kGap);
  EXPECT_FALSE(f.gaps.rebuild_due());
}

TEST(GapDetector, intervalIsCountedFromTheFrameBefore) {
  GapDetector gaps;
  EXPECT_EQ(gaps.since_frame(Stamp(1'000'000'000)), 0);
  EXPECT_DOUBLE_EQ(gaps.since_frame(Stamp(1'050'000'000)), kUsual);
  gaps.clear_rebuild();
  EXPECT_DOUBLE_EQ(gaps.since_frame(Stamp(1'650'000'000)), kGap);
}

}  // namespace
}  // namespace vergence::odometry
