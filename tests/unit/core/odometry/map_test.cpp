#include "core/odometry/map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace vergence::odometry {
namespace {

struct Filled {
  Arena arena;
  Map map;
  explicit Filled(std::size_t window) : map(window, arena) {}

  MapPoint* point(PointStage stage) {
    MapPoint* p = map.make_point();
    p->stage = stage;
    return p;
  }
  std::size_t keyframe(double x = 0) {
    return map.make_keyframe(
        {{Mat3::Identity(), Vec3(x, 0, 0)}, {}, Stamp(static_cast<std::int64_t>(x))});
  }
};

std::vector<int> order(const Map& map) { return {map.order().begin(), map.order().end()}; }

TEST(Map, fullMapRefusesUntilAPointIsFreed) {
  Filled f(5);
  for (std::size_t i = 0; i < kMaxPoints; ++i)
    ASSERT_NE(f.point(PointStage::candidate), nullptr) << i;
  EXPECT_EQ(f.map.make_point(), nullptr);
  MapPoint& somewhere = f.map.points()[1234];
  somewhere.found = 9;
  somewhere.missed = 2;
  somewhere.now.set(0, {1, 2}, 0.1F);
  somewhere.seen[3].set(1, {3, 4}, 0.1F);
  somewhere.stage = PointStage::free;
  MapPoint* again = f.map.make_point();
  ASSERT_EQ(again, &somewhere);
  EXPECT_EQ(again->found, 0);
  EXPECT_EQ(again->missed, 0);
  EXPECT_EQ(again->now.cameras, 0);
  for (const PointObservation& s : again->seen) EXPECT_EQ(s.cameras, 0);
}

TEST(Map, triedPointsLeaveNoTraceInTheOrderOfSlots) {
  Filled f(3);
  (void)f.point(PointStage::active);
  MapPoint* const tried = f.point(PointStage::candidate);
  (void)f.point(PointStage::candidate);
  for (MapPoint& p : f.map.points())
    if (p.stage == PointStage::candidate) p.stage = PointStage::free;
  f.map.reuse_slots();
  EXPECT_EQ(f.map.make_point(), tried);
}

TEST(Map, pointsEndWithTheLastSlotInUse) {
  Filled f(1);
  EXPECT_TRUE(f.map.points().empty());
  (void)f.point(PointStage::active);
  MapPoint* const last = f.point(PointStage::candidate);
  EXPECT_EQ(f.map.points().size(), 2U);
  last->stage = PointStage::free;
  // The second keyframe drops the first one.
  (void)f.keyframe();
  (void)f.keyframe();
  EXPECT_EQ(f.map.points().size(), 1U);
}

TEST(Map, fullWindowDropsItsOldestKeyframe) {
  Filled f(3);
  const std::size_t a = f.keyframe(1), b = f.keyframe(2), c = f.keyframe(3);
  EXPECT_EQ(order(f.map),
            (std::vector{static_cast<int>(a), static_cast<int>(b), static_cast<int>(c)}));
  const std::size_t d = f.keyframe(4);
  EXPECT_EQ(d, a) << "the slot of the oldest is free again";
  EXPECT_EQ(order(f.map),
            (std::vector{static_cast<int>(b), static_cast<int>(c), static_cast<int>(d)}));
  EXPECT_EQ(f.map.keyframe(d).T_left_world.t.x(), 4.0);
  EXPECT_EQ(f.map.keyframe(b).T_left_world.t.x(), 2.0);
  for (int i = 0; i < 100; ++i) (void)f.keyframe(i);
  EXPECT_EQ(f.map.order().size(), 3U);
}

TEST(Map, reusedKeyframeSlotHasNoObservations) {
  Filled f(2);
  MapPoint* p = f.point(PointStage::active);
  const std::size_t a = f.keyframe();
  p->seen[a].set(0, {10, 20}, 0.1F);
  const std::size_t b = f.keyframe();
  p->seen[b].set(0, {11, 20}, 0.1F);
  const std::size_t c = f.keyframe();
  EXPECT_EQ(c, a);
  EXPECT_EQ(p->seen[c].cameras, 0);
  EXPECT_EQ(p->seen[b].cameras, 1);
}

TEST(Map, dormantPointLivesWhileTheWindowSeesIt) {
  Filled f(2);
  MapPoint* early = f.point(PointStage::dormant);
  MapPoint* both = f.point(PointStage::dormant);
  MapPoint* active = f.point(PointStage::active);
  MapPoint* candidate = f.point(PointStage::candidate);
  const std::size_t a = f.keyframe();
  for (MapPoint* p : {early, both, active, candidate}) p->seen[a].set(1, {10, 20}, 0.1F);
  const std::size_t b = f.keyframe();
  both->seen[b].set(0, {10, 20}, 0.1F);
  EXPECT_EQ(early->stage, PointStage::dormant);
  // Keyframe a leaves the window.
  (void)f.keyframe();
  EXPECT_EQ(early->stage, PointStage::free);
  EXPECT_EQ(both->stage, PointStage::dormant);
  EXPECT_EQ(active->stage, PointStage::active) << "what is followed stays, seen or not";
  EXPECT_EQ(candidate->stage, PointStage::candidate);
  // Keyframe b leaves the window.
  (void)f.keyframe();
  EXPECT_EQ(both->stage, PointStage::free);
}

TEST(Map, clearedMapHasItsWholeCapacity) {
  Filled f(4);
  for (int i = 0; i < 10; ++i) {
    (void)f.point(PointStage::active);
    (void)f.keyframe(i);
  }
  f.map.clear();
  EXPECT_TRUE(f.map.order().empty());
  EXPECT_TRUE(std::all_of(f.map.points().begin(), f.map.points().end(),
                          [](const MapPoint& p) { return p.stage == PointStage::free; }));
  std::size_t n = 0;
  while (f.map.make_point() != nullptr && n <= kMaxPoints)
    f.map.points()[n++].stage = PointStage::active;
  EXPECT_EQ(n, kMaxPoints);
}

}  // namespace
}  // namespace vergence::odometry
