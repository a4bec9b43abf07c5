#include "core/odometry/gap_watch.hpp"

#include <gtest/gtest.h>

namespace vergence::odometry {
namespace {

constexpr double kLongest = 0.5, kUsual = 0.05, kGap = 0.6;  // s

TEST(GapWatch, oneGapLeavesARenewalDueUntilItIsDone) {
  GapWatch gaps;
  EXPECT_EQ(gaps.note(kUsual, kLongest, true), 0);
  EXPECT_FALSE(gaps.renewal_due());
  EXPECT_EQ(gaps.note(kGap, kLongest, true), kGap);
  EXPECT_TRUE(gaps.renewal_due());
  EXPECT_EQ(gaps.note(kUsual, kLongest, true), 0);
  EXPECT_TRUE(gaps.renewal_due());
  gaps.forget();
  EXPECT_FALSE(gaps.renewal_due());
}

TEST(GapWatch, whereEveryIntervalIsAGapTheSceneStays) {
  GapWatch gaps;
  (void)gaps.note(kGap, kLongest, true);
  gaps.forget();  // it was made anew
  for (int i = 0; i < 5; ++i) EXPECT_EQ(gaps.note(kGap, kLongest, true), kGap);
  EXPECT_FALSE(gaps.renewal_due());
}

TEST(GapWatch, withoutALinkNothingIsDue) {
  GapWatch gaps;
  EXPECT_EQ(gaps.note(kGap, kLongest, false), kGap);
  EXPECT_FALSE(gaps.renewal_due());
}

TEST(GapWatch, framesAreCountedFromTheOneBeforeWhateverItShowed) {
  GapWatch gaps;
  EXPECT_EQ(gaps.since_frame(Stamp(1'000'000'000)), 0);
  EXPECT_DOUBLE_EQ(gaps.since_frame(Stamp(1'050'000'000)), kUsual);
  gaps.forget();
  EXPECT_DOUBLE_EQ(gaps.since_frame(Stamp(1'650'000'000)), kGap);
}

}  // namespace
}  // namespace vergence::odometry
