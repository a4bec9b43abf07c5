#include "app/report/verdict.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace vergence::app::report {
namespace {

/// A drive with which nothing is wrong: 1000 frames, a reference, 0.8 % drift.
struct Case {
  Session session;
  Analysis analysis;

  Case() {
    for (int i = 0; i < 1000; ++i) {
      Frame f;
      f.posed = true;
      f.status = PoseStatus::ok;
      f.estimate_ms = 10;
      session.frames.push_back(f);
    }
    session.summary = {{"calibration", {{"word", "good"}}},
                       {"timing_ms", {{"p99", 20.0}}},
                       {"allocations_after_seal", 0}};
    analysis.read = analysis.ok = 1000;
    analysis.ok_share = 1.0;
    analysis.by_reason = {0};
    analysis.source = ErrorSource::reference;
    analysis.drift = 0.008;
    analysis.scale = 1.001;
    analysis.interval_s = 0.05;
  }
  [[nodiscard]] Verdict verdict() const { return judge(session, analysis); }
};

bool any_has(const std::vector<std::string>& sentences, const std::string& part) {
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& s) { return s.find(part) != std::string::npos; });
}

TEST(Verdict, aDriveWithNothingWrongIsGood) {
  const Verdict v = Case().verdict();
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_TRUE(v.reasons.empty() && v.advice.empty());
  EXPECT_FALSE(v.sentence.empty());
}

TEST(Verdict, withoutAReferenceItIsNeverGood) {
  Case c;
  c.analysis.source = ErrorSource::none;
  c.analysis.drift.reset();
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::care);
  EXPECT_TRUE(any_has(v.reasons, "no reference"));
}

TEST(Verdict, aDoubtThatPassedIsNoKnock) {
  Case c;
  c.session.reasons = {"recalibrating"};
  c.analysis.by_reason = {3};
  EXPECT_FALSE(any_has(c.verdict().advice, "knocked"));
  Event changed;
  changed.kind = "rig_changed";
  c.session.events.push_back(changed);
  EXPECT_TRUE(any_has(c.verdict().advice, "recalibrating (3 frames)"));
}

TEST(Verdict, driftAndScaleMoveTheGradeAtTheirLimits) {
  const std::vector<std::pair<double, Grade>> drifts{
      {0.02, Grade::good}, {0.021, Grade::care}, {0.05, Grade::care}, {0.051, Grade::bad}};
  for (const auto& [drift, grade] : drifts) {
    Case c;
    c.analysis.drift = drift;
    EXPECT_EQ(c.verdict().grade, grade) << drift;
  }
  Case c;
  c.analysis.scale = 0.96;  // reference = 0.96 of ours
  EXPECT_EQ(c.verdict().grade, Grade::care);
  EXPECT_TRUE(any_has(c.verdict().reasons, "too long"));
}

TEST(Verdict, lostFramesAndNoPosesAtAll) {
  Case c;
  c.analysis.ok = 950, c.analysis.lost = 50;
  EXPECT_EQ(c.verdict().grade, Grade::care);
  c.analysis.ok = 800, c.analysis.lost = 200;
  EXPECT_EQ(c.verdict().grade, Grade::bad);
  for (Frame& f : c.session.frames) f.posed = false;
  EXPECT_TRUE(any_has(c.verdict().reasons, "never was a pose"));
  EXPECT_EQ(judge(Session{}, analyse(Session{})).grade, Grade::bad);
}

TEST(Verdict, theWorstReasonComesFirst) {
  Case c;
  c.analysis.ok = 950, c.analysis.lost = 50;
  c.session.summary["calibration"]["word"] = "recalibrate";
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::bad);
  ASSERT_EQ(v.reasons.size(), 2U);
  EXPECT_NE(v.reasons[0].find("calibration"), std::string::npos);
}

TEST(Verdict, everyReasonOfAPoseHasItsAdvice) {
  Event changed;
  changed.kind = "rig_changed";
  for (int i = 1; i <= static_cast<int>(Reason::unproven_pairing); ++i) {
    Case c;
    c.session.reasons.emplace_back(to_string(static_cast<Reason>(i)));
    c.analysis.by_reason = {0, 3};
    c.session.events.push_back(changed);
    EXPECT_TRUE(any_has(c.verdict().advice, "3 frames")) << c.session.reasons.back();
  }
}

CalibrationRow attempt(bool accepted, const char* cause, double before_px, double after_px) {
  CalibrationRow row;
  row.accepted = accepted;
  row.decided = true;
  row.cause = cause;
  row.reason = accepted ? "" : "it is worse";
  row.held_out_before_px = before_px;
  row.held_out_after_px = after_px;
  return row;
}

TEST(Verdict, aWeakCalibrationSaysWhatWouldHelp) {
  Case c;
  c.session.summary["calibration"] = {{"word", "recalibrate"}, {"limited_by", "intrinsics"}};
  EXPECT_TRUE(any_has(c.verdict().advice, "driving on does not help"));
  c.session.summary["calibration"]["limited_by"] = "noise";
  EXPECT_TRUE(any_has(c.verdict().advice, "near and far structure"));
}

TEST(Verdict, aShortBaselineIsJudgedWhereItCanSee) {
  Case c;
  c.session.summary["calibration"]["word"] = "recalibrate";
  c.session.calibrations = {attempt(true, "refinement", 1, 0.2)};
  EXPECT_EQ(c.verdict().grade, Grade::bad);
  c.session.calibrations.back().judged_depth_m = 2.4;
  c.session.calibrations.back().depth_sigma_percent = 1.0;
  EXPECT_EQ(c.verdict().grade, Grade::care);
  EXPECT_TRUE(any_has(c.verdict().reasons, "1.0 % at 2.4 m"));
  c.session.calibrations.back().depth_sigma_percent = 3.0;
  EXPECT_EQ(c.verdict().grade, Grade::bad);
}

TEST(Verdict, aKnockThatWasMendedIsAdviceAndNoGrade) {
  Case c;
  c.session.calibrations = {attempt(true, "knock", 1.4, 0.2)};
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_TRUE(any_has(v.advice, "knocked"));
}

TEST(Verdict, aRejectedCalibrationIsADoubtUnlessTheOneInUseFitsAsWell) {
  Case c;
  c.session.calibrations = {attempt(true, "from_scratch", 0, 0.2),
                            attempt(false, "drift", 1.4, 0.2)};
  EXPECT_EQ(c.verdict().grade, Grade::care);
  EXPECT_TRUE(any_has(c.verdict().advice, "it is worse"));
  c.session.calibrations.back() = attempt(false, "requested", 0.2, 0.2);
  EXPECT_EQ(c.verdict().grade, Grade::good);
}

TEST(Verdict, aDriveThatWasNotPlacedWithItsInsSaysSoAndNotThatThereWasNone) {
  Case c;
  c.analysis.source = ErrorSource::none;
  c.analysis.ins_unplaced = true;
  const Verdict v = c.verdict();
  EXPECT_TRUE(any_has(v.reasons, "was not placed on the earth"));
  EXPECT_FALSE(any_has(v.reasons, "no reference"));
  EXPECT_TRUE(any_has(v.advice, "comparison.placement_m"));
}

TEST(Verdict, aMeasurementThatWasNotTakenIsNoRejection) {
  Case c;
  c.session.calibrations = {attempt(true, "given", 0, 0), attempt(false, "refinement", 1.4, 0.2)};
  c.session.calibrations.back().kept = true;
  EXPECT_EQ(c.verdict().grade, Grade::good);
}

TEST(Verdict, theWaitForTheFirstConfirmationIsNotHeldAgainstTheDrive) {
  Case c;
  c.session.reasons.emplace_back("unverified_calibration");
  c.analysis.ok = 600, c.analysis.degraded = 400;
  c.analysis.by_reason = {0, 400}, c.analysis.waited_by_reason = {0, 400};
  c.analysis.waited = 400;
  c.analysis.confirmed_s = 20;
  c.session.calibrations = {attempt(true, "given", 0, 0)};
  c.session.summary["calibration"]["verified"] = true;
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_TRUE(v.advice.empty());
  EXPECT_NE(v.sentence.find("400 before the drive had confirmed"), std::string::npos);
}

TEST(Verdict, aDriveThatEndsWithoutVerificationSaysWhatWouldHelp) {
  Case c;
  c.session.calibrations = {attempt(true, "given", 0, 0)};
  c.session.summary["calibration"]["verified"] = false;
  EXPECT_EQ(c.verdict().grade, Grade::care);
  EXPECT_TRUE(any_has(c.verdict().reasons, "has not confirmed its calibration"));
  for (const char* help : {"turns", "near things at the roadside", "corners of the image"})
    EXPECT_TRUE(any_has(c.verdict().advice, help));
  c.analysis.confirmed_s = 20;
  EXPECT_TRUE(any_has(c.verdict().reasons, "at the end is not verified"));
  c.session.summary["calibration"]["online"] = false;
  EXPECT_TRUE(any_has(c.verdict().reasons, "is not verified, nothing watched it"));
}

TEST(Verdict, aTornSessionThatWaitedInVainSaysSo) {
  Case c;
  c.session.summary = nullptr;
  c.session.calibrations = {attempt(true, "given", 0, 0)};
  EXPECT_FALSE(any_has(c.verdict().reasons, "confirmed"));
  c.analysis.degraded = c.analysis.waited = 1000, c.analysis.ok = 0;
  EXPECT_TRUE(any_has(c.verdict().reasons, "has not confirmed its calibration"));
}

TEST(Verdict, aContradictedCalibrationIsTold) {
  Case c;
  c.session.calibrations = {attempt(true, "given", 0, 0)};
  c.session.events = {
      {Stamp(), "calibration_contradicted",
       "the calibration in use is not that of the rig: its depths are off by 6.1 %"}};
  EXPECT_TRUE(any_has(c.verdict().advice, "off by 6.1 %"));
}

TEST(Verdict, aFocalLengthThatTheDriveContradictsMakesItUseless) {
  Case c;
  auto& focal = c.session.summary["calibration"]["focal_length"];
  focal = {{"given_px", 898.6}, {"measured_px", 711.2}, {"sigma_px", 12.0}};
  focal["contradicted"] = false;
  EXPECT_EQ(c.verdict().grade, Grade::good);
  focal["contradicted"] = true;
  Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::bad);
  EXPECT_FALSE(v.usable);
  EXPECT_TRUE(
      any_has(v.reasons, "899 px, is not that of these images: the drive measures 711 ± 12"));
  EXPECT_TRUE(any_has(v.advice, "--focal"));
  focal["sigma_px"] = 0.0;
  v = c.verdict();
  EXPECT_TRUE(any_has(v.reasons, "the drive measures 711 px or still farther from it"));
}

TEST(Verdict, neverACalibrationSaysHowToGetOne) {
  Case c;
  c.session.calibrations = {attempt(false, "from_scratch", 0, 0.9)};
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::care);
  EXPECT_TRUE(any_has(v.reasons, "no calibration was found"));
  EXPECT_TRUE(any_has(v.advice, "near and far"));
  c.session.calibrations.clear();
  EXPECT_EQ(c.verdict().grade, Grade::good) << "nothing is known of it";
  c.session.summary["calibration"]["accepted"] = 0;
  EXPECT_TRUE(any_has(c.verdict().reasons, "no calibration was found"));
}

TEST(Verdict, aScaleThatDisagreesAndACalibrationThatWasNotKeptAreTold) {
  Case c;
  c.session.events = {
      {Stamp(), "scale_disagrees", "the distance travelled comes out 90.0 % longer"},
      {Stamp(), "calibration_not_kept", "no room"}};
  c.session.calibrations = {attempt(true, "from_scratch", 0, 0.2)};
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::care);
  EXPECT_TRUE(any_has(v.advice, "90.0 % longer"));
  EXPECT_TRUE(any_has(v.advice, "no room"));
}

TEST(Verdict, aTornSessionSaysHowToCloseOne) {
  Case c;
  c.session.summary = nullptr;
  c.session.missing = {"summary.json is missing"};
  const Verdict v = c.verdict();
  EXPECT_EQ(v.grade, Grade::care);
  EXPECT_TRUE(any_has(v.advice, "not closed"));
}

TEST(Verdict, slowFramesAndAllocationsGiveAdvice) {
  Case c;
  for (std::size_t i = 0; i < 20; ++i) c.session.frames[i].estimate_ms = 80;
  c.session.summary["allocations_after_seal"] = 3;
  c.session.summary["drops"] = {{"lines", 4}};
  const Verdict v = c.verdict();
  EXPECT_TRUE(any_has(v.advice, "frame interval"));
  EXPECT_TRUE(any_has(v.advice, "Memory was taken 3 times"));
  EXPECT_TRUE(any_has(v.reasons, "4 lines"));
}

}  // namespace
}  // namespace vergence::app::report
