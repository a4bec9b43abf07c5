#include "drivers/sync/rig_synchronizer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <vector>

#include "core/math/random.hpp"

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);

SyncOptions options(int cameras = 2) {
  return {.cameras = cameras, .interval = kInterval, .hold = kInterval * 2};
}

HostStamp middle_of(std::uint64_t pulse) {
  return HostStamp(1'000'000'000) + kInterval * static_cast<std::int64_t>(pulse);
}

SyncFrame frame(int camera, std::uint64_t counter, std::uint64_t pulse, FrameSlot slot = 0) {
  return {.camera = camera,
          .slot = slot,
          .counter = counter,
          .middle = {middle_of(pulse) + Duration::microseconds(30 * camera),
                     Duration::microseconds(100)},
          .arrival = middle_of(pulse) + Duration::milliseconds(10 + camera)};
}

std::vector<SyncedSet> drain(RigSynchronizer* sync) {
  std::vector<SyncedSet> sets;
  for (SyncedSet set; sync->next(&set);) sets.push_back(set);
  return sets;
}

std::vector<SyncedSet> offer(RigSynchronizer* sync, const SyncFrame& f,
                             SyncResult expected = SyncResult::accepted) {
  EXPECT_EQ(sync->offer(f), expected) << "camera " << f.camera << " counter " << f.counter;
  return drain(sync);
}

TEST(RigSynchronizer, pulseUnseenByAllCamerasIsMissedNotLost) {
  RigSynchronizer sync(options());
  (void)offer(&sync, frame(0, 0, 0));
  (void)offer(&sync, frame(1, 0, 0));
  (void)offer(&sync, frame(0, 3, 3));
  EXPECT_EQ(offer(&sync, frame(1, 3, 3)).size(), 1U);
  EXPECT_EQ(sync.counters().missed, 2U);
  EXPECT_EQ(sync.counters().lost[0] + sync.counters().lost[1], 0U);
}

TEST(RigSynchronizer, silentCameraDelaysASetByAtMostTheHold) {
  RigSynchronizer sync(options());
  EXPECT_TRUE(offer(&sync, frame(0, 0, 0)).empty());
  EXPECT_TRUE(offer(&sync, frame(0, 1, 1)).empty());
  const auto sets = offer(&sync, frame(0, 2, 2));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_EQ(sets[0].number, 0U);
}

TEST(RigSynchronizer, absentCameraIsNotAwaitedAndReturns) {
  RigSynchronizer sync(options());
  (void)offer(&sync, frame(0, 0, 0));
  (void)offer(&sync, frame(1, 0, 0));
  sync.absent(1);
  for (std::uint64_t i = 1; i < 40; ++i) EXPECT_EQ(offer(&sync, frame(0, i, i)).size(), 1U);
  EXPECT_EQ(sync.counters().absent[1], 39U);
  EXPECT_EQ(sync.counters().lost[1], 0U);
  sync.restarted(1);
  EXPECT_TRUE(offer(&sync, frame(0, 40, 40)).empty()) << "camera 1 is waited for again";
  const auto sets = offer(&sync, frame(1, 0, 40, 9));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_TRUE(sets[0].complete);
  (void)offer(&sync, frame(1, 1, 41));
  EXPECT_EQ(offer(&sync, frame(0, 41, 41)).size(), 1U);
}

TEST(RigSynchronizer, matchesAModelUnderRandomLossAndDelay) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const std::size_t cameras = 2 + seed % 3;
    Random random(seed);
    RigSynchronizer sync(options(static_cast<int>(cameras)));
    // Which pulses each camera has given and will give next, the images of the sets that wait, and
    // the first number that has not gone out.
    std::vector<std::set<std::uint64_t>> given(cameras);
    std::vector<std::uint64_t> at(cameras, 0);
    std::map<std::uint64_t, std::map<std::size_t, FrameSlot>> waiting;
    std::uint64_t first = 0, sets = 0, duplicates = 0, lates = 0;
    FrameSlot slot = 0;
    const auto capture_sets = [&] {
      for (SyncedSet set; sync.next(&set); ++sets) {
        ASSERT_FALSE(waiting.empty());
        ASSERT_EQ(waiting.begin()->first, set.number) << "the oldest first, none without an image";
        const auto images = waiting.begin()->second;
        waiting.erase(waiting.begin());
        first = set.number + 1;
        for (std::size_t k = 0; k < cameras; ++k) {
          ASSERT_EQ(set.present[k], images.contains(k));
          ASSERT_TRUE(!set.present[k] || set.slots[k] == images.at(k));
        }
        ASSERT_EQ(set.complete, images.size() == cameras);
      }
    };
    for (int step = 0; step < 20000 && !HasFatalFailure(); ++step) {
      const std::size_t k = random.below(static_cast<std::uint32_t>(cameras));
      std::uint64_t& pulse = at[k];
      std::uint64_t number = pulse;
      switch (random.below(20)) {
        // Some frames are lost.
        case 0:
          pulse += 1 + random.below(3);
          continue;
        // A frame is repeated that is not older than what is remembered.
        case 1:
          if (pulse > 0) number = pulse - 1 - std::min<std::uint64_t>(pulse - 1, random.below(6));
          break;
        // No camera runs ahead of another by more than the transport's depth.
        default:
          if (pulse > *std::min_element(at.begin(), at.end()) + 6) continue;
          ++pulse;
      }
      const SyncResult expected = given[k].contains(number) ? SyncResult::duplicate
                                  : number < first          ? SyncResult::late
                                                            : SyncResult::accepted;
      ASSERT_EQ(sync.offer(frame(static_cast<int>(k), number, number, slot)), expected)
          << "step " << step << " camera " << k << " pulse " << number;
      duplicates += expected == SyncResult::duplicate ? 1 : 0;
      lates += expected == SyncResult::late ? 1 : 0;
      if (expected == SyncResult::accepted) given[k].insert(number), waiting[number][k] = slot;
      slot = static_cast<FrameSlot>(slot + 1);
      capture_sets();
      ASSERT_TRUE(waiting.empty() || waiting.begin()->second.size() < cameras) << "step " << step;
      ASSERT_LE(waiting.size(), RigSynchronizer::kOpen);
    }
    sync.finish();
    capture_sets();
    EXPECT_TRUE(waiting.empty()) << "every slot that was accepted has come out";
    const SyncCounters& c = sync.counters();
    EXPECT_EQ(c.complete + c.incomplete, sets);
    EXPECT_EQ(std::accumulate(c.duplicate.begin(), c.duplicate.end(), std::uint64_t{0}),
              duplicates);
    EXPECT_EQ(std::accumulate(c.late.begin(), c.late.end(), std::uint64_t{0}), lates);
    EXPECT_GT(std::min({duplicates, c.complete, c.incomplete}), 100U);
    EXPECT_GT(lates, 10U);
  }
}

TEST(RigSynchronizer, knownLostImageIsNotAwaited) {
  RigSynchronizer sync(options());
  (void)offer(&sync, frame(1, 0, 0));
  sync.lost(0, 0);
  auto sets = drain(&sync);
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_FALSE(sets[0].present[0]);
  EXPECT_TRUE(sets[0].present[1]);
  (void)offer(&sync, frame(1, 1, 1));
  sets = offer(&sync, frame(0, 1, 1));
  ASSERT_EQ(sets.size(), 1U) << "the next one is waited for";
  EXPECT_TRUE(sets[0].complete);
  EXPECT_EQ(sync.counters().lost[0], 1U);
}

TEST(RigSynchronizer, disagreeingStampsUnverifyASet) {
  RigSynchronizer sync(options());
  (void)offer(&sync, frame(0, 0, 0));
  auto sets = offer(&sync, frame(1, 0, 0));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_EQ(sets[0].proof, SyncProof::counted);
  (void)offer(&sync, frame(0, 1, 1));
  // The counter is the same, but the exposure is one pulse later.
  sets = offer(&sync, frame(1, 1, 2));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_TRUE(sets[0].complete);
  EXPECT_EQ(sets[0].proof, SyncProof::ambiguous);
  EXPECT_EQ(sync.counters().ambiguous, 1U);
  EXPECT_EQ(sync.counters().realigned, 0U)
      << "the pulses began with the cameras: the counters are right or a trigger was missed";
}

TEST(RigSynchronizer, wrongStartIsCorrected) {
  SyncOptions o = options();
  o.align_start = true;
  RigSynchronizer sync(o);
  (void)offer(&sync, frame(0, 0, 0));
  SyncFrame misled = frame(1, 0, 1);
  // The stamp is the first of a clock that is not known yet.
  misled.middle.host = middle_of(0);
  (void)offer(&sync, misled);
  int ambiguous = 0, counted = 0;
  for (std::uint64_t n = 1; n < 40; ++n) {
    auto sets = offer(&sync, frame(0, n, n));
    // The frame is truly of the next pulse.
    SyncFrame other = frame(1, n, n + 1);
    other.arrival = frame(0, n, n).arrival;
    EXPECT_NE(sync.offer(other), SyncResult::late);
    for (const SyncedSet& set : drain(&sync)) sets.push_back(set);
    for (const SyncedSet& set : sets) {
      ambiguous += set.proof == SyncProof::ambiguous ? 1 : 0;
      counted += set.complete && set.proof == SyncProof::counted ? 1 : 0;
    }
  }
  EXPECT_EQ(ambiguous, RigSynchronizer::kAmbiguous);
  EXPECT_GE(counted, 25);
  EXPECT_EQ(sync.counters().realigned, 1U);
}

SyncOptions by_time() {
  SyncOptions o = options();
  o.mode = SyncMode::approximate_time;
  o.tolerance = Duration::milliseconds(3);
  return o;
}

SyncFrame timed(int camera, std::uint64_t counter, double ms) {
  SyncFrame f = frame(camera, counter, 0);
  f.middle.host = middle_of(0) + Duration::seconds(ms * 1e-3);
  f.arrival = f.middle.host + Duration::milliseconds(10);
  return f;
}

TEST(RigSynchronizer, freeRunningImagesArePairedByTime) {
  RigSynchronizer sync(by_time());
  Random random(5);
  std::uint64_t complete = 0;
  std::vector<HostStamp> stamps;
  const auto offer_and_collect = [&](const SyncFrame& f) {
    for (const SyncedSet& set : offer(&sync, f)) {
      complete += set.complete ? 1 : 0;
      stamps.push_back(set.stamp);
      EXPECT_EQ(set.proof, SyncProof::by_time);
      EXPECT_LE(set.spread, Duration::milliseconds(3));
    }
  };
  // The counters mean nothing: camera 1 has counted 1000 exposures more, and jitters by up to 2.5
  // ms.
  for (std::uint64_t n = 0; n < 200; ++n) {
    // The cameras rest for five seconds.
    const double at = n < 15 ? 50.0 * static_cast<double>(n) : 50.0 * static_cast<double>(n) + 5013;
    offer_and_collect(timed(0, n, at));
    if (n != 7) offer_and_collect(timed(1, n + 1000, at + random.uniform(-2.5, 2.5)));
  }
  EXPECT_EQ(complete, 199U);
  EXPECT_EQ(sync.counters().lost[1], 1U);
  EXPECT_TRUE(std::is_sorted(stamps.begin(), stamps.end()));
  EXPECT_EQ(sync.offer(timed(1, 99, 100)), SyncResult::late);
}

}  // namespace
}  // namespace vergence
