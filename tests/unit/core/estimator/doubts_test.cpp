#include "core/estimator/doubts.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

TEST(DoubtLedger, strongestDoubtIsReported) {
  DoubtLedger ledger;
  EXPECT_EQ(ledger.strongest(true), nullptr);
  ledger.enter(Doubt::window, Reason::time_gap, 7, 3);
  ledger.enter(Doubt::rig, Reason::recalibrating, 8);
  ASSERT_NE(ledger.strongest(true), nullptr);
  EXPECT_EQ(ledger.strongest(true)->reason, Reason::recalibrating);
  EXPECT_TRUE(ledger.any_up_to(Doubt::rig));
  ledger.strike(Doubt::rig);
  EXPECT_EQ(ledger.strongest(true)->reason, Reason::time_gap);
  EXPECT_FALSE(ledger.any_up_to(Doubt::rig));
}

TEST(DoubtLedger, doubtEndsAfterItsEvidence) {
  DoubtLedger ledger;
  EXPECT_FALSE(ledger.weaken(Doubt::scene));
  ledger.enter(Doubt::scene, Reason::map_reset, 5, 2);
  EXPECT_FALSE(ledger.weaken(Doubt::scene));
  EXPECT_TRUE(ledger.weaken(Doubt::scene));
  EXPECT_FALSE(ledger.stands(Doubt::scene));
  ledger.enter(Doubt::rig, Reason::recalibrating, 5);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(ledger.weaken(Doubt::rig));
  EXPECT_TRUE(ledger.stands(Doubt::rig));
}

TEST(DoubtLedger, doubtKeepsItsFirstFrame) {
  DoubtLedger ledger;
  for (std::uint64_t frame = 11; frame < 15; ++frame)
    ledger.hold(Doubt::frame, true, Reason::few_inliers, frame);
  EXPECT_EQ(ledger[Doubt::frame].since, 11U);
  ledger.hold(Doubt::frame, false, Reason::few_inliers, 15);
  EXPECT_FALSE(ledger.stands(Doubt::frame));
  ledger.hold(Doubt::frame, true, Reason::few_inliers, 16);
  EXPECT_EQ(ledger[Doubt::frame].since, 16U);
}

TEST(DoubtLedger, lateImageIsNoDoubtWhileStanding) {
  DoubtLedger ledger;
  ledger.enter(Doubt::late_image, Reason::image_repeated, 3, 12);
  EXPECT_EQ(ledger.strongest(false), nullptr);
  EXPECT_NE(ledger.strongest(true), nullptr);
}

}  // namespace
}  // namespace vergence
