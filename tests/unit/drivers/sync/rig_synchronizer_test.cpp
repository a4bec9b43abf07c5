#include "drivers/sync/rig_synchronizer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "core/math/random.hpp"

namespace vergence {
namespace {

constexpr Duration kInterval = Duration::milliseconds(50);

SyncOptions options(int cameras = 2) {
  SyncOptions o;
  o.cameras = cameras;
  o.interval = kInterval;
  o.hold = kInterval * 2;
  return o;
}

HostStamp middle_of(std::uint64_t pulse) {
  return HostStamp(1'000'000'000) + kInterval * static_cast<std::int64_t>(pulse);
}

SyncFrame frame(int camera, std::uint64_t counter, std::uint64_t pulse, FrameSlot slot = 0) {
  SyncFrame f;
  f.camera = camera;
  f.slot = slot;
  f.counter = counter;
  f.middle = {middle_of(pulse) + Duration::microseconds(30 * camera), Duration::microseconds(100)};
  f.arrival = middle_of(pulse) + Duration::milliseconds(10 + camera);
  return f;
}

std::vector<SyncedSet> drain(RigSynchronizer* sync) {
  std::vector<SyncedSet> sets;
  for (SyncedSet set; sync->next(&set);) sets.push_back(set);
  return sets;
}

std::vector<SyncedSet> offer(RigSynchronizer* sync, const SyncFrame& f,
                             SyncVerdict expected = SyncVerdict::taken) {
  EXPECT_EQ(sync->offer(f), expected) << "camera " << f.camera << " counter " << f.counter;
  return drain(sync);
}

TEST(RigSynchronizer, aSetGoesOutWithItsLastImageAndCarriesCameraZerosStamp) {
  RigSynchronizer sync(options());
  EXPECT_TRUE(offer(&sync, frame(1, 0, 0, 7)).empty());
  const auto sets = offer(&sync, frame(0, 0, 0, 3));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_TRUE(sets[0].complete);
  EXPECT_EQ(sets[0].slots[0], 3);
  EXPECT_EQ(sets[0].slots[1], 7);
  EXPECT_EQ(sets[0].stamp, middle_of(0));
  EXPECT_EQ(sets[0].error, Duration::microseconds(100));
  EXPECT_EQ(sets[0].spread, Duration::microseconds(30));
}

TEST(RigSynchronizer, aLostImageIsKnownWhenTheNextOneOfThatCameraComes) {
  RigSynchronizer sync(options());
  EXPECT_TRUE(offer(&sync, frame(0, 0, 0)).empty());
  EXPECT_TRUE(offer(&sync, frame(0, 1, 1)).empty());
  const auto sets = offer(&sync, frame(1, 1, 1));
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_FALSE(sets[0].complete);
  EXPECT_FALSE(sets[0].present[1]);
  EXPECT_TRUE(sets[1].complete);
  EXPECT_EQ(sync.counters().lost[1], 1U);
  EXPECT_EQ(sync.counters().missed, 0U);
}

TEST(RigSynchronizer, aPulseThatNobodySawIsMissedAndNotLost) {
  RigSynchronizer sync(options());
  (void)offer(&sync, frame(0, 0, 0));
  (void)offer(&sync, frame(1, 0, 0));
  (void)offer(&sync, frame(0, 3, 3));
  EXPECT_EQ(offer(&sync, frame(1, 3, 3)).size(), 1U);
  EXPECT_EQ(sync.counters().missed, 2U);
  EXPECT_EQ(sync.counters().lost[0] + sync.counters().lost[1], 0U);
}

TEST(RigSynchronizer, aSilentCameraHoldsASetNoLongerThanTheHold) {
  RigSynchronizer sync(options());
  EXPECT_TRUE(offer(&sync, frame(0, 0, 0)).empty());
  EXPECT_TRUE(offer(&sync, frame(0, 1, 1)).empty());
  const auto sets = offer(&sync, frame(0, 2, 2));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_EQ(sets[0].number, 0U);
}

TEST(RigSynchronizer, nobodyWaitsForAnAbsentCameraAndItComesBackByTime) {
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

/// What a synchroniser may know, kept in plain containers: which pulses each camera has given,
/// which sets are out.
class Shadow {
 public:
  explicit Shadow(int cameras) : given_(static_cast<std::size_t>(cameras)) {}

  SyncVerdict verdict(int camera, std::uint64_t pulse) {
    auto& given = given_[static_cast<std::size_t>(camera)];
    if (given.contains(pulse)) return SyncVerdict::duplicate;
    if (any_out_ && pulse <= last_out_) return SyncVerdict::late;
    given.insert(pulse);
    return SyncVerdict::taken;
  }
  void taken(int camera, std::uint64_t pulse, FrameSlot slot) { waiting_[pulse][camera] = slot; }

  void out(const SyncedSet& set) {
    if (any_out_) {
      ASSERT_GT(set.number, last_out_) << "in order, each once";
    }
    any_out_ = true;
    last_out_ = set.number;
    ASSERT_FALSE(waiting_.empty());
    ASSERT_EQ(waiting_.begin()->first, set.number) << "the oldest first, and none without an image";
    const auto images = waiting_.begin()->second;
    waiting_.erase(waiting_.begin());
    for (int k = 0; k < static_cast<int>(given_.size()); ++k) {
      ASSERT_EQ(set.present[static_cast<std::size_t>(k)], images.contains(k));
      if (images.contains(k)) {
        ASSERT_EQ(set.slots[static_cast<std::size_t>(k)], images.at(k));
      }
    }
    ASSERT_EQ(set.complete, images.size() == given_.size());
    ++sets_;
  }
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }
  [[nodiscard]] std::uint64_t sets() const { return sets_; }
  /// No complete set may wait behind nothing.
  [[nodiscard]] bool oldest_complete() const {
    return !waiting_.empty() && waiting_.begin()->second.size() == given_.size();
  }

 private:
  std::vector<std::set<std::uint64_t>> given_;
  std::map<std::uint64_t, std::map<int, FrameSlot>> waiting_;
  bool any_out_ = false;
  std::uint64_t last_out_ = 0, sets_ = 0;
};

TEST(RigSynchronizer, behavesLikeItsShadowUnderRandomLossRepetitionAndDelay) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int cameras = 2 + static_cast<int>(seed % 3);
    Random random(seed);
    RigSynchronizer sync(options(cameras));
    Shadow shadow(cameras);
    std::vector<std::uint64_t> at(static_cast<std::size_t>(cameras),
                                  0);  // next pulse of each camera
    FrameSlot slot = 0;
    std::uint64_t duplicates = 0, lates = 0;
    for (int step = 0; step < 20000; ++step) {
      const int k = static_cast<int>(random.below(static_cast<std::uint32_t>(cameras)));
      auto& pulse = at[static_cast<std::size_t>(k)];
      std::uint64_t number = pulse;
      switch (random.below(20)) {
        case 0:  // some are lost
          pulse += 1 + random.below(3);
          continue;
        case 1:  // one again, not older than what is remembered
          if (pulse > 0) number = pulse - 1 - std::min<std::uint64_t>(pulse - 1, random.below(6));
          break;
        default: {  // no camera runs ahead of another by more than the transport's depth
          std::uint64_t slowest = pulse;
          for (const std::uint64_t p : at) slowest = std::min(slowest, p);
          if (pulse > slowest + 6) continue;
          ++pulse;
        }
      }
      const SyncVerdict expected = shadow.verdict(k, number);
      const SyncFrame f = frame(k, number, number, slot);
      ASSERT_EQ(sync.offer(f), expected)
          << "step " << step << " camera " << k << " pulse " << number;
      duplicates += expected == SyncVerdict::duplicate ? 1 : 0;
      lates += expected == SyncVerdict::late ? 1 : 0;
      if (expected == SyncVerdict::taken) shadow.taken(k, number, slot);
      slot = static_cast<FrameSlot>(slot + 1);
      for (SyncedSet set; sync.next(&set);) {
        shadow.out(set);
        if (::testing::Test::HasFatalFailure()) return;
      }
      ASSERT_FALSE(shadow.oldest_complete()) << "step " << step;
      ASSERT_LE(shadow.waiting(), RigSynchronizer::kOpen);
    }
    sync.finish();
    for (SyncedSet set; sync.next(&set);) shadow.out(set);
    EXPECT_EQ(shadow.waiting(), 0U) << "every slot that was taken has come out";
    const SyncCounters& c = sync.counters();
    EXPECT_EQ(c.complete + c.incomplete, shadow.sets());
    std::uint64_t counted_duplicates = 0, counted_lates = 0;
    for (std::size_t k = 0; k < kMaxCameras; ++k)
      counted_duplicates += c.duplicate[k], counted_lates += c.late[k];
    EXPECT_EQ(counted_duplicates, duplicates);
    EXPECT_EQ(counted_lates, lates);
    EXPECT_GT(duplicates, 100U);
    EXPECT_GT(lates, 10U);
    EXPECT_GT(c.complete, 100U);
    EXPECT_GT(c.incomplete, 100U);
  }
}

TEST(RigSynchronizer, nobodyWaitsForAnImageThatIsKnownToBeLost) {
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

TEST(RigSynchronizer, stampsThatDisagreeMakeASetUnproven) {
  RigSynchronizer sync(options());
  (void)offer(&sync, frame(0, 0, 0));
  auto sets = offer(&sync, frame(1, 0, 0));
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_EQ(sets[0].proof, SyncProof::counted);
  (void)offer(&sync, frame(0, 1, 1));
  sets = offer(&sync, frame(1, 1, 2));  // the same counter, exposed a pulse later
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_TRUE(sets[0].complete);
  EXPECT_EQ(sets[0].proof, SyncProof::unproven);
  EXPECT_EQ(sync.counters().unproven, 1U);
  EXPECT_EQ(sync.counters().realigned, 0U)
      << "the pulses began with the cameras: the counters are right or a trigger was missed";
}

TEST(RigSynchronizer, aStartThatWasFoundWronglyIsFoundAgain) {
  SyncOptions o = options();
  o.align_start = true;
  RigSynchronizer sync(o);
  (void)offer(&sync, frame(0, 0, 0));
  SyncFrame misled = frame(1, 0, 1);
  misled.middle.host = middle_of(0);  // the first stamps of a clock that is not known yet
  (void)offer(&sync, misled);
  int unproven = 0, counted = 0;
  for (std::uint64_t n = 1; n < 40; ++n) {
    auto sets = offer(&sync, frame(0, n, n));
    SyncFrame other = frame(1, n, n + 1);  // of the next pulse, in truth
    other.arrival = frame(0, n, n).arrival;
    EXPECT_NE(sync.offer(other), SyncVerdict::late);
    for (const SyncedSet& set : drain(&sync)) sets.push_back(set);
    for (const SyncedSet& set : sets) {
      unproven += set.proof == SyncProof::unproven ? 1 : 0;
      counted += set.complete && set.proof == SyncProof::counted ? 1 : 0;
    }
  }
  EXPECT_EQ(unproven, RigSynchronizer::kUnproven);
  EXPECT_GE(counted, 25);
  EXPECT_EQ(sync.counters().realigned, 1U);
}

SyncOptions by_time() {
  SyncOptions o = options();
  o.mode = SyncMode::software;
  o.tolerance = Duration::milliseconds(3);
  return o;
}

SyncFrame timed(int camera, std::uint64_t counter, double ms) {
  SyncFrame f = frame(camera, counter, 0);
  f.middle.host = middle_of(0) + Duration::seconds(ms * 1e-3);
  f.arrival = f.middle.host + Duration::milliseconds(10);
  return f;
}

TEST(RigSynchronizer, withoutATriggerWhatIsNearInTimeIsPairedAndSaysSo) {
  RigSynchronizer sync(by_time());
  // The counters mean nothing: camera 1 has counted 1000 exposures more, and jitters by up to 2.5
  // ms.
  Random random(5);
  int complete = 0;
  for (std::uint64_t n = 0; n < 200; ++n) {
    const double at = 50.0 * static_cast<double>(n);
    (void)offer(&sync, timed(0, n, at));
    const auto sets = offer(&sync, timed(1, n + 1000, at + random.uniform(-2.5, 2.5)));
    ASSERT_EQ(sets.size(), 1U) << n;
    complete += sets[0].complete ? 1 : 0;
    EXPECT_EQ(sets[0].proof, SyncProof::by_time);
    EXPECT_EQ(sets[0].number, n);
    EXPECT_LE(sets[0].spread, Duration::milliseconds(3));
  }
  EXPECT_EQ(complete, 200);
}

TEST(RigSynchronizer, byTimeAPauseAndALostImageCostNothingElse) {
  RigSynchronizer sync(by_time());
  std::uint64_t complete = 0;
  std::vector<HostStamp> stamps;
  const auto take = [&](const SyncFrame& f) {
    for (const SyncedSet& set : offer(&sync, f)) {
      complete += set.complete ? 1 : 0;
      stamps.push_back(set.stamp);
    }
  };
  for (std::uint64_t n = 0; n < 30; ++n) {
    const double at = n < 15 ? 50.0 * static_cast<double>(n)
                             : 50.0 * static_cast<double>(n) + 5013;  // five seconds of rest
    take(timed(0, n, at));
    if (n != 7) take(timed(1, n, at + 1));
  }
  EXPECT_EQ(complete, 29U);
  EXPECT_EQ(sync.counters().lost[1], 1U);
  EXPECT_TRUE(std::is_sorted(stamps.begin(), stamps.end()));
  EXPECT_EQ(sync.offer(timed(1, 99, 100)), SyncVerdict::late);
}

}  // namespace
}  // namespace vergence
