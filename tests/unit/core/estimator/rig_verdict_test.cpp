#include "core/estimator/detail/rig_verdict.hpp"

#include <gtest/gtest.h>

namespace vergence {
namespace {

using calibration::DisparityJump;
using calibration::MonitorVerdict;
using Kind = MonitorVerdict::Kind;

MonitorVerdict quiet(double statistic = 1) {
  MonitorVerdict v;
  v.statistic = statistic;
  v.in_step = v.shows_no_lag = true;
  return v;
}
MonitorVerdict told(Kind kind, std::uint64_t onset) {
  MonitorVerdict v = quiet(100);
  v.kind = kind;
  v.onset_frame = onset;
  return v;
}
MonitorVerdict without_matches() {
  MonitorVerdict v;
  v.needs_texture = true;
  return v;
}
DisparityJump confirmed(std::uint64_t onset) {
  DisparityJump jump;
  jump.measured = jump.confirmed = true;
  jump.onset_frame = onset;
  return jump;
}
DisparityJump suspected() {
  DisparityJump jump;
  jump.measured = jump.suspected = true;
  return jump;
}

// Cameras 1 and 2 of three.
MonitorVerdict of(const MonitorVerdict& one, const MonitorVerdict& two,
                  const DisparityJump& jump_of_one = {}, const DisparityJump& jump_of_two = {}) {
  RigVerdict rig;
  rig.add(one, jump_of_one);
  rig.add(two, jump_of_two);
  return rig.of_all();
}

TEST(RigVerdict, isTheWorstOfTheCameras) {
  EXPECT_EQ(of(quiet(), quiet()).kind, Kind::quiet);
  EXPECT_EQ(of(quiet(1), quiet(3)).statistic, 3);
  for (const bool second : {false, true}) {
    const MonitorVerdict knock = told(Kind::knock, 7), drift = told(Kind::drift, 3);
    const MonitorVerdict v = second ? of(drift, knock) : of(knock, drift);
    EXPECT_EQ(v.kind, Kind::knock);
    EXPECT_EQ(v.onset_frame, 7U);
  }
}

TEST(RigVerdict, isUndecidedWhereOneCameraIsAndTheOtherIsQuietWithALargerStatistic) {
  MonitorVerdict doubtful = quiet(20);
  doubtful.undecided = true;
  EXPECT_TRUE(of(doubtful, quiet(30)).undecided);
  EXPECT_TRUE(of(quiet(30), doubtful).undecided);
  EXPECT_TRUE(of(quiet(), quiet(), suspected()).undecided);
  EXPECT_TRUE(of(quiet(), quiet(), {}, suspected()).undecided);
  EXPECT_FALSE(of(quiet(), quiet()).undecided);
}

TEST(RigVerdict, isInStepWhereAllCamerasAreThatMeasure) {
  EXPECT_TRUE(of(quiet(), quiet()).in_step);
  MonitorVerdict stands = quiet();
  stands.in_step = stands.shows_no_lag = false;
  for (const MonitorVerdict& v : {of(quiet(), stands), of(stands, quiet())}) {
    EXPECT_FALSE(v.in_step);
    EXPECT_FALSE(v.shows_no_lag);
  }
  // One that looks the other way has no matches, ever: it neither speaks nor keeps the others from
  // it.
  for (const MonitorVerdict& v : {of(quiet(), without_matches()), of(without_matches(), quiet())}) {
    EXPECT_TRUE(v.in_step);
    EXPECT_TRUE(v.shows_no_lag);
  }
  EXPECT_FALSE(of(without_matches(), without_matches()).in_step);
  EXPECT_FALSE(of(without_matches(), without_matches()).shows_no_lag);
}

TEST(RigVerdict, ofAJumpIsAKnockButNoCollapse) {
  MonitorVerdict v = of(quiet(), told(Kind::drift, 3), confirmed(9));
  EXPECT_EQ(v.kind, Kind::knock);
  EXPECT_EQ(v.onset_frame, 9U);
  v = of(told(Kind::collapse, 4), quiet(), confirmed(9));
  EXPECT_EQ(v.kind, Kind::collapse);
  EXPECT_EQ(v.onset_frame, 4U);
}

TEST(RigVerdict, ofJumpsAloneSaysNothingOfTheStep) {
  RigVerdict rig;
  rig.add(suspected());
  rig.add(DisparityJump{});
  EXPECT_EQ(rig.of_all().kind, Kind::quiet);
  EXPECT_TRUE(rig.of_all().undecided);
  EXPECT_FALSE(rig.of_all().in_step);
  rig.add(confirmed(5));
  EXPECT_EQ(rig.of_all().kind, Kind::knock);
  EXPECT_EQ(rig.of_all().onset_frame, 5U);
}

}  // namespace
}  // namespace vergence
