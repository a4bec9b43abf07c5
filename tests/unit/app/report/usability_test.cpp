#include "app/report/usability.hpp"

#include <gtest/gtest.h>

#include "app/report/verdict.hpp"

namespace vergence::app::report {
namespace {

/// A drive of frames that are all degraded for one reason, with the last `lost` of them without a
/// pose.
Session drive(std::size_t frames, const char* reason, std::size_t lost = 0) {
  Session s;
  s.reasons = {"", reason};
  for (std::size_t i = 0; i < frames; ++i) {
    Frame f;
    f.stamp = Stamp(static_cast<std::int64_t>(i) * 100'000'000);
    f.posed = i + lost < frames;
    f.status = f.posed ? PoseStatus::degraded : PoseStatus::lost;
    f.reason = 1;
    s.frames.push_back(f);
  }
  s.summary = nlohmann::json::object();
  return s;
}

Verdict verdict_of(const Session& s) { return judge(s, analyse(s)); }

CalibrationRow rejected(const char* reason) {
  CalibrationRow row;
  row.reason = reason;
  return row;
}

TEST(Usability, aDriveWithoutAnOkFrameIsNotToBeUsedAndSaysWhyWithACount) {
  const Verdict v = verdict_of(drive(100, "few_inliers"));
  EXPECT_EQ(v.grade, Grade::bad);
  EXPECT_FALSE(v.usable);
  EXPECT_NE(v.main_reason.find("not one of 100 frames is ok: few_inliers (100 of 100 frames). "
                               "Poses rested on few points"),
            std::string::npos)
      << v.main_reason;
}

TEST(Usability, whatStoppedTheCalibrationIsTheMainReason) {
  Session s = drive(100, "uncalibrated");
  s.calibrations = {rejected("it is worse"), rejected("the right camera is on the left")};
  const Verdict v = verdict_of(s);
  EXPECT_FALSE(v.usable);
  EXPECT_NE(v.main_reason.find("no calibration was found: the right camera is on the left"),
            std::string::npos)
      << v.main_reason;
  EXPECT_TRUE(s.missing.empty());
}

TEST(Usability, aShortDriveThatCouldNotConfirmYetIsUnverifiedAndNoMore) {
  for (const char* waits : {"unverified_calibration", "uncalibrated", "unconfirmed"}) {
    const Verdict v = verdict_of(drive(kFramesToConfirm - 1, waits));
    EXPECT_EQ(v.grade, Grade::care) << waits;
    EXPECT_TRUE(v.usable) << waits;
    EXPECT_NE(v.sentence.find("nverified: the drive ended after 59 frames"), std::string::npos)
        << v.sentence;
    EXPECT_FALSE(verdict_of(drive(kFramesToConfirm, waits)).usable) << waits;
  }
  EXPECT_FALSE(verdict_of(drive(30, "few_inliers")).usable) << "that is no waiting";
  EXPECT_FALSE(verdict_of(drive(30, "unverified_calibration", 10)).usable) << "a third has no pose";
}

TEST(Usability, framesThatStandStillConfirmNothing) {
  Session s = drive(100, "unverified_calibration");
  s.summary = {{"calibration", {{"baseline_m", 0.5}}}};
  for (std::size_t i = 0; i < s.frames.size(); ++i)
    s.frames[i].T_world_left.t.z() = i < 50 ? 0 : 0.2 * static_cast<double>(i - 50);
  EXPECT_TRUE(verdict_of(s).usable) << "fifty moved";
  for (std::size_t i = 0; i < s.frames.size(); ++i)
    s.frames[i].T_world_left.t.z() = 0.2 * static_cast<double>(i);
  EXPECT_FALSE(verdict_of(s).usable);
}

TEST(Usability, neverAPoseSaysOfWhat) {
  const Verdict v = verdict_of(drive(40, "cameras_swapped", 40));
  EXPECT_FALSE(v.usable);
  EXPECT_NE(v.main_reason.find("there never was a pose: cameras_swapped (40 of 40 frames)"),
            std::string::npos)
      << v.main_reason;
  EXPECT_NE(v.main_reason.find("swapped, or T_camera_left is inverted"), std::string::npos)
      << v.main_reason;
}

TEST(Usability, framesThatWereNotReadAreTheReasonWhereTheyAreMost) {
  Session s = drive(1, "unverified_calibration");
  s.summary = {{"frames", {{"skipped", 99}}}};
  for (int i = 0; i < 99; ++i) s.events.push_back({Stamp(i), "image_torn", "frame skipped"});
  const Verdict v = verdict_of(s);
  EXPECT_FALSE(v.usable);
  EXPECT_NE(v.main_reason.find("image_torn (99 of 100 frames)"), std::string::npos)
      << v.main_reason;
}

TEST(Usability, oneOkFrameOrUnknownStatusesAreNoReason) {
  Session s = drive(100, "unverified_calibration");
  s.frames.back().status = PoseStatus::ok;
  EXPECT_TRUE(verdict_of(s).usable);
  for (Frame& f : s.frames) f.status.reset();
  EXPECT_TRUE(verdict_of(s).usable);
}

}  // namespace
}  // namespace vergence::app::report
