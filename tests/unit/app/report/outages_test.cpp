#include "app/report/outages.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "app/report/happenings.hpp"
#include "app/report/verdict.hpp"

namespace vergence::app::report {
namespace {

Stamp at(double s) { return Stamp(static_cast<std::int64_t>(s * 1e9)); }

Event event(double s, const char* kind, const char* sentence = "") {
  return {at(s), kind, sentence};
}

Event gone(double s, int camera) {
  return {at(s), "camera_gone",
          "camera " + std::to_string(camera) + " is gone; the drive goes on without it"};
}

Event back(double s, int camera) {
  return {at(s), "camera_back", "camera " + std::to_string(camera) + " is back"};
}

/// Frames at 20 Hz of a drive with which nothing is wrong, but for those between `from` and `to`.
Session drive(double seconds, double from = 0, double to = 0) {
  Session s;
  for (int i = 0; i < static_cast<int>(seconds * 20); ++i) {
    const double t = i * 0.05;
    if (t >= from && t < to) continue;
    Frame f;
    f.stamp = at(t);
    f.number = i;
    f.status = PoseStatus::ok;
    f.posed = true;
    f.T_world_left.t = {0, 0, 0.5 * i};
    s.frames.push_back(f);
    s.reference.push_back({f.stamp, f.T_world_left});
  }
  s.summary = {{"calibration", {{"word", "good"}, {"verified", true}}},
               {"frames", {{"skipped", 20 * (to - from)}}},
               {"metrics", {{"scale", 1.0}, {"segment_error_percent", 0.5}}}};
  return s;
}

Verdict verdict_of(const Session& s) { return judge(s, analyse(s)); }

bool any_has(const std::vector<std::string>& sentences, const std::string& part) {
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& s) { return s.find(part) != std::string::npos; });
}

TEST(Outages, ofDevicesThatWentAndCameAtOnceAreOne) {
  const std::vector<Event> events{gone(40, 0),   gone(40.1, 1), back(80.2, 1),
                                  back(80.1, 0), gone(90, 1),   back(91, 1)};
  const auto outages = outages_of(events);
  ASSERT_EQ(outages.size(), 2U);
  EXPECT_EQ(gone_sentence(outages[0].devices), "cameras 0, 1 were gone");
  EXPECT_EQ(outages[0].from, at(40));
  EXPECT_EQ(outages[0].to, at(80.2));
  EXPECT_EQ(gone_sentence(outages[1].devices), "camera 1 was gone");
}

TEST(Outages, ofALooseCableAreSummedUp) {
  std::vector<Event> events;
  for (int i = 0; i < 50; ++i) {
    events.push_back(gone(10 + 0.6 * i, 1));
    events.push_back(back(10.3 + 0.6 * i, 1));
  }
  const auto sums = summed(outages_of(events));
  ASSERT_EQ(sums.size(), 1U);
  EXPECT_EQ(sums[0].count, 50U);
  EXPECT_NEAR(sums[0].seconds, 15, 1e-6);
}

TEST(Outages, ofAnythingElseThatIsCalledSoAreTold) {
  EXPECT_TRUE(outages_of(std::vector{event(1, "camera_back"), event(2, "state")}).empty());
  const std::vector<Event> events{event(1, "camera_gone"), event(1, "board_gone")};
  EXPECT_EQ(gone_sentence(outages_of(events).at(0).devices),
            "a camera and the trigger board were gone");
}

TEST(Outages, camerasThatNeverCameBackMakeNoGoodDrive) {
  Session s = drive(30);
  ASSERT_EQ(verdict_of(s).grade, Grade::good);
  s.events = {gone(30.005, 0), gone(30.005, 1)};
  const Verdict v = verdict_of(s);
  EXPECT_EQ(v.grade, Grade::bad);
  ASSERT_FALSE(v.reasons.empty());
  EXPECT_EQ(v.reasons[0], "no frame after 30.0 s: cameras 0, 1 were gone");
  ASSERT_FALSE(v.advice.empty());
  EXPECT_EQ(v.advice[0],
            "Cameras 0, 1 were gone from 30.0 s to the end: check their cables and power.");
}

TEST(Outages, ofABoardThatNeverCameBackAreTheSame) {
  Session s = drive(90);
  s.events = {event(90.2, "board_gone", "the trigger board is gone: check its cable")};
  const Verdict v = verdict_of(s);
  EXPECT_EQ(v.grade, Grade::bad);
  EXPECT_TRUE(any_has(v.reasons, "no frame after 1:30 min: the trigger board was gone"));
}

TEST(Outages, ofOneCameraThatTheOthersDroveOnWithoutAskForCare) {
  Session s = drive(60);
  s.events = {gone(30, 1)};
  const Verdict v = verdict_of(s);
  EXPECT_EQ(v.grade, Grade::care);
  EXPECT_TRUE(any_has(v.reasons, "camera 1 was gone from 30.0 s to the end"));
}

TEST(Outages, comeBeforeWhatTheyMadeOfTheDrive) {
  Session s = drive(120, 40, 80);
  s.summary["metrics"]["scale"] = 1.045;
  EXPECT_TRUE(any_has(verdict_of(s).advice, "Lengths disagree"));
  s.events = {gone(40, 0), gone(40, 1), back(80, 0), back(80.01, 1)};
  const Verdict v = verdict_of(s);
  EXPECT_FALSE(any_has(v.advice, "Lengths disagree"));
  EXPECT_FALSE(any_has(v.reasons, "lengths come out"));
  EXPECT_TRUE(any_has(v.reasons, "cameras 0, 1 were gone for 40.0 s"));
  ASSERT_FALSE(v.advice.empty());
  EXPECT_EQ(v.advice[0],
            "Cameras 0, 1 were gone for 40.0 s from 40.0 s on: check their cables and power.");
  const std::string table = happenings_table(s, analyse(s));
  EXPECT_NE(
      table.find(
          "<td>cameras 0, 1 were gone</td> <td class=\"w\">once</td> <td class=\"w\">40.0 … 1:20"),
      std::string::npos)
      << table;
}

TEST(Outages, elsewhereLeaveTheLengthsToBeJudged) {
  Session s = drive(120);
  s.summary["metrics"]["scale"] = 1.045;
  s.events = {gone(40, 1), back(43, 1)};
  EXPECT_TRUE(any_has(verdict_of(s).advice, "Lengths disagree")) << "the other camera went on";
}

TEST(Outages, ofADriveWithoutAFrameAreTheReasonAndNotItsCalibration) {
  Session s = drive(0);
  s.summary["calibration"]["verified"] = false;
  CalibrationRow given;
  given.accepted = true;
  s.calibrations = {given};
  s.events = {gone(0.1, 0), gone(0.1, 1)};
  const Verdict v = verdict_of(s);
  EXPECT_EQ(v.grade, Grade::bad);
  ASSERT_FALSE(v.reasons.empty());
  EXPECT_EQ(v.reasons[0], "there never was a frame: cameras 0, 1 were gone");
  ASSERT_EQ(v.advice.size(), 1U);
  EXPECT_EQ(v.advice[0], "Cameras 0, 1 were gone to the end: check their cables and power.");
}

TEST(Outages, afterTheFramesThatAreReadSayNothingOfTheLastOfThem) {
  Session s = drive(30);
  s.left_out = {"poses.csv has more than 600 lines; the rest is left out"};
  s.events = {gone(50, 0)};
  EXPECT_FALSE(any_has(verdict_of(s).reasons, "no frame after"));
  EXPECT_TRUE(any_has(verdict_of(s).reasons, "longer than the report reads"));
}

}  // namespace
}  // namespace vergence::app::report
