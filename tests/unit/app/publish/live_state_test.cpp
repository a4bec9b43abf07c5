#include "app/publish/live_state.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <nlohmann/json.hpp>

namespace vergence::app {
namespace {

using nlohmann::json;

constexpr HostStamp kNow(1'000'000'000'000);

FrameReport at(double metres, PoseStatus status = PoseStatus::ok) {
  FrameReport r;
  r.pose.status = status;
  r.pose.T_world_left.t = {0, 0, metres};
  return r;
}

EventRecord event(const char* kind, std::string_view message) {
  EventRecord e;
  e.kind = kind;
  e.set_message(message);
  return e;
}

CalibrationRecord calibration(bool is_refinement, double x) {
  CalibrationRecord c;
  c.accepted = !is_refinement;
  c.is_refinement = c.decided = is_refinement;
  c.cause = CalibrationCause::refinement;
  c.calibration.cameras = 2;
  c.calibration.T_camera_left[1].t = {x, 0, 0};
  if (is_refinement) c.calibration.sigma_total[1] = {1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3};
  return c;
}

void add_frame(LiveState* state, const FrameReport& report) {
  state->add(PosedFrame{report});
  state->add(report);
}

TEST(LiveState, sendsChangesSinceAVersion) {
  LiveState state;
  state.begin({.name = "a drive", .frames = 100});
  add_frame(&state, at(0));
  // This motion is too short for a step of the trail.
  add_frame(&state, at(0.1));
  FrameReport report = at(1, PoseStatus::degraded);
  report.counts.read = 3, report.counts.ok = 2, report.counts.lost = 1;
  report.counts.path_m = 12.5;
  report.pose.frame = 41;
  report.pose.reason = Reason::few_inliers;
  add_frame(&state, report);
  state.add(event("mark", "a <b>mark</b> \xff"));
  const json first = state.since(0, kNow);
  EXPECT_EQ(first["session"], "a drive");
  EXPECT_FALSE(first["ended"].get<bool>());
  EXPECT_EQ(first["now"]["frame"], 41);
  EXPECT_EQ(first["now"]["read"], 3);
  EXPECT_EQ(first["now"]["status"], "degraded");
  EXPECT_NE(first["now"]["advice"], "");
  EXPECT_EQ(first["trail"].size(), 2U);
  EXPECT_EQ(first["events"].size(), 1U);
  EXPECT_TRUE(first.contains("calibration"));
  add_frame(&state, at(2));
  const json second = state.since(first["version"], kNow);
  EXPECT_EQ(second["trail"], json::parse("[[0.0,0.0,2.0,0]]"));
  EXPECT_EQ(second["trail_from"], 2);
  EXPECT_TRUE(second["events"].empty());
  EXPECT_FALSE(second.contains("calibration"));
  EXPECT_EQ(state.since(0, kNow)["trail"].size(), 3U);
}

TEST(LiveState, longTrailIsThinnedOverItsWholeLength) {
  LiveState state;
  std::uint64_t version = 0;
  std::size_t reported = 0;
  bool anew = false;
  for (int i = 0; i < 50'000; ++i) {
    add_frame(&state, at(i));
    if (i % 100 != 0) continue;
    const json update = state.since(version, kNow);
    version = update["version"];
    const auto from = update["trail_from"].get<std::size_t>();
    anew = anew || from < reported;
    reported = from + update["trail"].size();
  }
  const json trail = state.since(0, kNow)["trail"];
  EXPECT_TRUE(anew);
  EXPECT_LE(trail.size(), LiveTrail::kMax);
  EXPECT_GE(trail.size(), LiveTrail::kMax / 2);
  EXPECT_EQ(trail.front()[2], 0.0);
  EXPECT_GE(trail.back()[2].get<double>(), 49'900.0);
  EXPECT_GE(reported + 100, trail.size()) << "a viewer who was there has as much";
}

/// Number of places on the map with a status, and the longest step between two.
struct Map {
  std::size_t places = 0, degraded = 0;
  double longest_m = 0;
};

Map map_of(const LiveState& state) {
  Map out;
  const json trail = state.since(0, kNow)["trail"];
  out.places = trail.size();
  for (std::size_t i = 0; i < trail.size(); ++i) {
    if (trail[i][3] == 1) ++out.degraded;
    if (i > 0) {
      const double step = trail[i][2].get<double>() - trail[i - 1][2].get<double>();
      out.longest_m = std::max(out.longest_m, step);
    }
  }
  return out;
}

TEST(LiveState, standingRigKeepsTrail) {
  LiveState state;
  double metres = 0;
  for (int i = 0; i < 2000; ++i) add_frame(&state, at(metres += 0.5));
  for (int i = 0; i < 36'000; ++i)
    add_frame(&state, at(metres, i % 2 == 0 ? PoseStatus::ok : PoseStatus::degraded));
  Map map = map_of(state);
  EXPECT_EQ(map.places, 2000U);
  EXPECT_EQ(map.longest_m, 0.5);
  EXPECT_EQ(map.degraded, 1U) << "the worst of where it stood";
  for (int i = 0; i < 2000; ++i) add_frame(&state, at(metres += 0.5));
  map = map_of(state);
  EXPECT_LE(map.longest_m, 1.0);
  EXPECT_EQ(map.degraded, 1U);
}

FrameReport come(double seconds) {
  FrameReport report = at(0);
  report.estimated = HostStamp(Duration::seconds(seconds).ns());
  return report;
}

TEST(LiveState, missingFramesAreSilentAfterOneSecond) {
  LiveState state;
  for (int i = 0; i < 100; ++i) add_frame(&state, come(50 + 0.05 * i));
  const auto now = [&](double seconds) {
    return state.since(0, HostStamp(Duration::seconds(seconds).ns()))["now"];
  };
  EXPECT_FALSE(now(55.5)["silent"].get<bool>());
  const json silent = now(67.95);
  EXPECT_TRUE(silent["silent"].get<bool>());
  EXPECT_EQ(silent["since_s"], 13.0);
  add_frame(&state, come(68));
  EXPECT_FALSE(now(68.5)["silent"].get<bool>());
  EXPECT_TRUE(now(69.5)["silent"].get<bool>()) << "an outage is no interval";
}

TEST(LiveState, keepsNewestEventsAndCalibrations) {
  LiveState state;
  for (int i = 0; i < 1000; ++i) state.add(event("mark", std::to_string(i)));
  const json events = state.since(0, kNow)["events"];
  EXPECT_EQ(events.size(), LiveState::kEvents);
  EXPECT_EQ(events.back()["message"], "999");
  for (int i = 0; i < 100; ++i) state.add(calibration(true, -0.5));
  EXPECT_EQ(state.since(0, kNow)["calibration"]["history"].size(), LiveState::kCalibrations);
}

TEST(LiveState, calibrationHasTwoSigmaAndMeasuredOne) {
  LiveState state;
  state.add(calibration(false, -0.75));
  json c = state.since(0, kNow)["calibration"];
  EXPECT_FALSE(c["verified"].get<bool>());
  EXPECT_EQ(c["cameras"][1]["parameters"][3][0], -750.0);
  EXPECT_TRUE(c["cameras"][1]["parameters"][3][1].is_null()) << "given without a sigma";
  EXPECT_FALSE(c.contains("measured"));
  state.add(event("calibration_verified", ""));
  state.add(calibration(true, -0.751));
  c = state.since(0, kNow)["calibration"];
  EXPECT_TRUE(c["verified"].get<bool>());
  EXPECT_EQ(c["cameras"][1]["parameters"][3][0], -750.0) << "what is in use stays";
  EXPECT_EQ(c["measured"][1]["parameters"][3][0], -751.0);
  EXPECT_EQ(c["measured"][1]["parameters"][3][1], 2.0);
}

}  // namespace
}  // namespace vergence::app
