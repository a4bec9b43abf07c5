#include "drivers/sync/pulse_matcher.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(40), kLimit = Duration::microseconds(200);

/// A train of ten pulses whose edges are these milliseconds off an even grid, none where shorter.
PulseTrain train_of(std::initializer_list<double> off_ms) {
  PulseTrain train(kInterval);
  auto off = off_ms.begin();
  for (std::uint64_t n = 0; n < 10; ++n) {
    Pulse pulse;
    pulse.number = n;
    pulse.mapped = true;
    pulse.edge = DeviceStamp(0) + kInterval * static_cast<int>(n) +
                 Duration::seconds(off != off_ms.end() ? *off++ / 1000 : 0);
    pulse.host = HostStamp(pulse.edge.ns());
    train.add(pulse, 0);
  }
  return train;
}

TEST(MissedTriggerDoubt, evenIntervalsNeverSettleIt) {
  const PulseTrain train = train_of({});
  MissedTriggerDoubt doubt;
  ASSERT_TRUE(doubt.add(1));
  for (std::uint64_t n = 3; n < 10; ++n) EXPECT_FALSE(doubt.compare(train, n, kLimit));
  EXPECT_TRUE(doubt.any());
}

TEST(MissedTriggerDoubt, anIntervalThatDiffersByMoreThanTheLimitSettlesIt) {
  const PulseTrain train = train_of({0, 0, 0, 0, 0.3, 0.3});
  MissedTriggerDoubt doubt;
  ASSERT_TRUE(doubt.add(1));
  EXPECT_FALSE(doubt.compare(train, 3, kLimit)) << "the first one that is compared";
  EXPECT_TRUE(doubt.compare(train, 4, kLimit));
  EXPECT_FALSE(doubt.any());
}

TEST(MissedTriggerDoubt, everyNumberOfMissedTriggersHasToBeRefuted) {
  const PulseTrain train = train_of({0, 0, 0, 0, 0.3, 0.3, 0.3});
  MissedTriggerDoubt doubt;
  ASSERT_TRUE(doubt.add(2));
  // At pulse 4 the pulses one and two before are 0.3 ms further off than before; both are refuted.
  EXPECT_FALSE(doubt.compare(train, 3, kLimit));
  EXPECT_TRUE(doubt.compare(train, 4, kLimit));
}

TEST(MissedTriggerDoubt, anotherMissedTriggerBeginsTheComparisonAnew) {
  const PulseTrain train = train_of({0, 0, 0, 0, 0.3, 0.3});
  MissedTriggerDoubt doubt;
  ASSERT_TRUE(doubt.add(1));
  EXPECT_FALSE(doubt.compare(train, 3, kLimit));
  ASSERT_TRUE(doubt.add(1));
  EXPECT_FALSE(doubt.compare(train, 4, kLimit)) << "nothing to compare with yet";
}

TEST(MissedTriggerDoubt, moreThanItCanFollowIsRefused) {
  MissedTriggerDoubt doubt;
  EXPECT_TRUE(doubt.add(MissedTriggerDoubt::kMost));
  EXPECT_FALSE(doubt.add(1));
}

}  // namespace
}  // namespace vergence
