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
  c.is_refinement = is_refinement;
  c.decided = is_refinement;
  c.cause = CalibrationCause::refinement;
  c.calibration.cameras = 2;
  c.calibration.T_camera_left[1].t = {x, 0, 0};
  if (is_refinement) c.calibration.sigma_total[1] = {1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3};
  return c;
}

TEST(LiveState, updateSendsChangesOnceHelloEverything) {
  LiveState state;
  SessionStart start;
  start.name = "a drive";
  start.frames = 100;
  state.begin(start);
  LiveFrame frame;
  frame.read = 3, frame.ok = 2, frame.lost = 1;
  frame.path_m = 12.5;
  frame.pose.frame = 41;
  frame.pose.status = PoseStatus::degraded;
  frame.pose.reason = Reason::few_inliers;
  state.add(frame);
  state.add(at(0));
  state.add(at(0.1));  // no step
  state.add(at(1));
  state.add(event("mark", "a <b>mark</b> \xff"));
  const json first = json::parse(state.update(kNow, -1));
  EXPECT_EQ(first["now"]["frame"], 41);
  EXPECT_EQ(first["now"]["read"], 3);
  EXPECT_EQ(first["now"]["status"], "degraded");
  EXPECT_NE(first["now"]["advice"], "");
  EXPECT_TRUE(first["now"]["line_age_p99_ms"].is_null());
  EXPECT_EQ(first["trail"].size(), 2U);
  EXPECT_EQ(first["events"].size(), 1U);
  state.add(at(2));
  const json second = json::parse(state.update(kNow, 3.25));
  EXPECT_EQ(second["trail"], json::parse("[[0.0,0.0,2.0,0]]"));
  EXPECT_TRUE(second["events"].empty());
  EXPECT_EQ(second["now"]["line_age_p99_ms"], 3.25);
  const json hello = json::parse(state.hello(kNow));
  EXPECT_EQ(hello["session"], "a drive");
  EXPECT_EQ(hello["trail"].size(), 3U);
  EXPECT_EQ(hello["events"].size(), 1U);
  EXPECT_FALSE(hello["ended"].get<bool>());
}

TEST(LiveState, longTrailIsThinnedOverItsWholeLength) {
  LiveState state;
  std::size_t told = 0;
  bool anew = false;
  for (int i = 0; i < 50'000; ++i) {
    state.add(at(i));
    if (i % 100 != 0) continue;
    const json update = json::parse(state.update(kNow, -1));
    const auto from = update["trail_from"].get<std::size_t>();
    anew = anew || from < told;
    told = from + update["trail"].size();
  }
  const json trail = json::parse(state.hello(kNow))["trail"];
  EXPECT_TRUE(anew);
  EXPECT_LE(trail.size(), LiveTrail::kMax);
  EXPECT_GE(trail.size(), LiveTrail::kMax / 2);
  EXPECT_EQ(trail.front()[2], 0.0);
  EXPECT_GE(trail.back()[2].get<double>(), 49'900.0);
  EXPECT_GE(told + 100, trail.size()) << "a viewer who was there has as much";
}

/// Number of places on the map with a status, and the longest step between two.
struct Map {
  std::size_t places = 0, degraded = 0;
  double longest_m = 0;
};

Map map_of(const LiveState& state) {
  Map out;
  const json trail = json::parse(state.hello(kNow))["trail"];
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
  for (int i = 0; i < 2000; ++i) state.add(at(metres += 0.5));
  for (int i = 0; i < 36'000; ++i)
    state.add(at(metres, i % 2 == 0 ? PoseStatus::ok : PoseStatus::degraded));
  Map map = map_of(state);
  EXPECT_EQ(map.places, 2000U);
  EXPECT_EQ(map.longest_m, 0.5);
  EXPECT_EQ(map.degraded, 1U) << "the worst of where it stood";
  for (int i = 0; i < 2000; ++i) state.add(at(metres += 0.5));
  map = map_of(state);
  EXPECT_LE(map.longest_m, 1.0);
  EXPECT_EQ(map.degraded, 1U);
}

LiveFrame come(double seconds) {
  LiveFrame frame;
  frame.out = HostStamp(Duration::seconds(seconds).ns());
  frame.pose.status = PoseStatus::ok;
  return frame;
}

TEST(LiveState, missingFramesAreSilentAfterOneSecond) {
  LiveState state;
  for (int i = 0; i < 100; ++i) state.add(come(50 + 0.05 * i));
  const auto now = [&](double seconds) {
    return json::parse(state.update(HostStamp(Duration::seconds(seconds).ns()), -1))["now"];
  };
  EXPECT_FALSE(now(55.5)["silent"].get<bool>());
  const json silent = now(67.95);
  EXPECT_TRUE(silent["silent"].get<bool>());
  EXPECT_EQ(silent["since_s"], 13.0);
  EXPECT_TRUE(json::parse(state.hello(kNow))["now"]["silent"].get<bool>()) << "who comes late, too";
  state.add(come(68));
  EXPECT_FALSE(now(68.5)["silent"].get<bool>());
  EXPECT_TRUE(now(69.5)["silent"].get<bool>()) << "an outage is no interval";
}

TEST(LiveState, keepsNewestEventsAndCalibrations) {
  LiveState state;
  for (int i = 0; i < 1000; ++i) state.add(event("mark", std::to_string(i)));
  const json events = json::parse(state.update(kNow, -1))["events"];
  EXPECT_EQ(events.size(), LiveState::kEvents);
  EXPECT_EQ(events.back()["message"], "999");
  for (int i = 0; i < 100; ++i) state.add(calibration(true, -0.5));
  EXPECT_EQ(json::parse(state.hello(kNow))["calibration"]["history"].size(),
            LiveState::kCalibrations);
}

TEST(LiveState, calibrationHasTwoSigmaAndMeasuredOne) {
  LiveState state;
  state.add(calibration(false, -0.75));
  json c = json::parse(state.update(kNow, -1))["calibration"];
  EXPECT_FALSE(c["confirmed"].get<bool>());
  EXPECT_EQ(c["cameras"][1]["figures"][3][0], -750.0);
  EXPECT_TRUE(c["cameras"][1]["figures"][3][1].is_null()) << "given without a sigma";
  EXPECT_FALSE(c.contains("measured"));
  state.add(event("calibration_verified", ""));
  state.add(calibration(true, -0.751));
  c = json::parse(state.update(kNow, -1))["calibration"];
  EXPECT_TRUE(c["confirmed"].get<bool>());
  EXPECT_EQ(c["cameras"][1]["figures"][3][0], -750.0) << "what is in use stays";
  EXPECT_EQ(c["measured"][1]["figures"][3][0], -751.0);
  EXPECT_EQ(c["measured"][1]["figures"][3][1], 2.0);
  EXPECT_FALSE(json::parse(state.update(kNow, -1)).contains("calibration")) << "told once";
}

}  // namespace
}  // namespace vergence::app
