#include "core/estimator/degradations.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

TEST(DegradationLedger, strongestIsReported) {
  DegradationLedger ledger;
  EXPECT_EQ(ledger.strongest(true), nullptr);
  ledger.enter(Degradation::window, Reason::time_gap, 7, 3);
  ledger.enter(Degradation::rig, Reason::recalibrating, 8);
  ASSERT_NE(ledger.strongest(true), nullptr);
  EXPECT_EQ(ledger.strongest(true)->reason, Reason::recalibrating);
  EXPECT_TRUE(ledger.any_up_to(Degradation::rig));
  ledger.clear(Degradation::rig);
  EXPECT_EQ(ledger.strongest(true)->reason, Reason::time_gap);
  EXPECT_FALSE(ledger.any_up_to(Degradation::rig));
}

TEST(DegradationLedger, entryEndsAfterItsEvidence) {
  DegradationLedger ledger;
  EXPECT_FALSE(ledger.weaken(Degradation::scene));
  ledger.enter(Degradation::scene, Reason::map_reset, 5, 2);
  EXPECT_FALSE(ledger.weaken(Degradation::scene));
  EXPECT_TRUE(ledger.weaken(Degradation::scene));
  EXPECT_FALSE(ledger.active(Degradation::scene));
  ledger.enter(Degradation::rig, Reason::recalibrating, 5);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(ledger.weaken(Degradation::rig));
  EXPECT_TRUE(ledger.active(Degradation::rig));
}

TEST(DegradationLedger, entryKeepsItsFirstFrame) {
  DegradationLedger ledger;
  for (std::uint64_t frame = 11; frame < 15; ++frame)
    ledger.set(Degradation::frame, true, Reason::few_inliers, frame);
  EXPECT_EQ(ledger[Degradation::frame].since, 11U);
  ledger.set(Degradation::frame, false, Reason::few_inliers, 15);
  EXPECT_FALSE(ledger.active(Degradation::frame));
  ledger.set(Degradation::frame, true, Reason::few_inliers, 16);
  EXPECT_EQ(ledger[Degradation::frame].since, 16U);
}

}  // namespace
}  // namespace vergence
