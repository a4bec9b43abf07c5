#include "app/publish/live_state.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include <nlohmann/json.hpp>

namespace vergence::app {
namespace {

using nlohmann::json;

PoseRecord at(double metres, PoseStatus status = PoseStatus::ok) {
  PoseRecord r;
  r.status = status;
  r.world_left.t = {0, 0, metres};
  return r;
}

EventRecord event(const char* kind, std::string_view sentence) {
  EventRecord e;
  e.kind = kind;
  e.set_sentence(sentence);
  return e;
}

CalibrationRecord calibration(bool learnt, double x) {
  CalibrationRecord c;
  c.accepted = !learnt;
  c.learnt = learnt;
  c.cause = learnt ? "refinement" : "given";
  c.rig.cameras = 2;
  c.rig.T_camera_left[1] = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0};
  c.rig.T_camera_left[0] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  if (learnt) c.rig.sigma_wide[1] = {1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3};
  return c;
}

TEST(LiveState, tellsWhatIsNewOnceAndALateViewerEverything) {
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
  state.set_temperature(1, 41.26F);
  const json first = json::parse(state.update(-1));
  EXPECT_EQ(first["now"]["temperatures_c"], json::parse("[null, 41.3]"));
  EXPECT_EQ(first["now"]["frame"], 41);
  EXPECT_EQ(first["now"]["read"], 3);
  EXPECT_EQ(first["now"]["status"], "degraded");
  EXPECT_NE(first["now"]["advice"], "");
  EXPECT_TRUE(first["now"]["line_age_p99_ms"].is_null());
  EXPECT_EQ(first["trail"].size(), 2U);
  EXPECT_EQ(first["events"].size(), 1U);
  state.add(at(2));
  const json second = json::parse(state.update(3.25));
  EXPECT_EQ(second["trail"], json::parse("[[0.0,0.0,2.0,0]]"));
  EXPECT_TRUE(second["events"].empty());
  EXPECT_EQ(second["now"]["line_age_p99_ms"], 3.25);
  const json hello = json::parse(state.hello());
  EXPECT_EQ(hello["session"], "a drive");
  EXPECT_EQ(hello["trail"].size(), 3U);
  EXPECT_EQ(hello["events"].size(), 1U);
  EXPECT_FALSE(hello["ended"].get<bool>());
}

TEST(LiveState, aLateViewerReadsWhereACalibrationIsFromWhenItsSourceIsGone) {
  LiveState state;
  auto source = std::make_unique<std::string>("a calibration file of some other day");
  state.add(CalibrationRecord::begin({}, Stamp(), "given", *source));
  source.reset();
  const json hello = json::parse(state.hello());
  EXPECT_EQ(hello["calibration"]["history"][0]["reason"], "a calibration file of some other day");
}

TEST(LiveState, anOriginThatIsTooLongIsCutAtAWholeCharacter) {
  std::string path(254, '/');
  path += "\xc3\xa4";  // the second byte would be the array's last
  LiveState state;
  state.add(CalibrationRecord::begin({}, Stamp(), "state_file", path));
  const json hello = json::parse(state.hello());
  EXPECT_EQ(hello["calibration"]["history"][0]["reason"], std::string(254, '/'));
}

TEST(LiveState, aLongDriveIsThinnedFromItsStartToItsEnd) {
  LiveState state;
  std::size_t told = 0;
  bool anew = false;
  for (int i = 0; i < 50'000; ++i) {
    state.add(at(i));
    if (i % 100 != 0) continue;
    const json update = json::parse(state.update(-1));
    if (update.contains("trail_anew")) told = 0, anew = true;
    told += update["trail"].size();
  }
  const json trail = json::parse(state.hello())["trail"];
  EXPECT_TRUE(anew);
  EXPECT_LE(trail.size(), LiveState::kTrail);
  EXPECT_GE(trail.size(), LiveState::kTrail / 2);
  EXPECT_EQ(trail.front()[2], 0.0);
  EXPECT_GE(trail.back()[2].get<double>(), 49'900.0);
  EXPECT_GE(told + 100, trail.size()) << "a viewer who was there has as much";
}

TEST(LiveState, eventsAndCalibrationsAreTheNewest) {
  LiveState state;
  for (int i = 0; i < 1000; ++i) state.add(event("mark", std::to_string(i)));
  const json events = json::parse(state.update(-1))["events"];
  EXPECT_EQ(events.size(), LiveState::kEvents);
  EXPECT_EQ(events.back()["sentence"], "999");
  for (int i = 0; i < 100; ++i) state.add(calibration(true, -0.5));
  EXPECT_EQ(json::parse(state.hello())["calibration"]["history"].size(), LiveState::kCalibrations);
}

TEST(LiveState, aCalibrationStandsWithTwoSigmaAndWhatTheDriveMeasuredBesideIt) {
  LiveState state;
  EXPECT_EQ(state.rig(), nullptr);
  state.add(calibration(false, -0.75));
  json c = json::parse(state.update(-1))["calibration"];
  EXPECT_FALSE(c["confirmed"].get<bool>());
  EXPECT_EQ(c["cameras"][1]["figures"][3][0], -750.0);
  EXPECT_TRUE(c["cameras"][1]["figures"][3][1].is_null()) << "given without a sigma";
  EXPECT_FALSE(c.contains("measured"));
  state.add(event("calibration_confirmed", ""));
  state.add(calibration(true, -0.751));
  c = json::parse(state.update(-1))["calibration"];
  EXPECT_TRUE(c["confirmed"].get<bool>());
  EXPECT_EQ(c["cameras"][1]["figures"][3][0], -750.0) << "what is in use stays";
  EXPECT_EQ(c["measured"][1]["figures"][3][0], -751.0);
  EXPECT_EQ(c["measured"][1]["figures"][3][1], 2.0);
  EXPECT_FALSE(json::parse(state.update(-1)).contains("calibration")) << "told once";
  ASSERT_NE(state.rig(), nullptr);
}

}  // namespace
}  // namespace vergence::app
