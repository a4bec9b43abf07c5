#include <gtest/gtest.h>

#include "app/report/report.hpp"

namespace vergence::app {
namespace {

ReportOutcome good() {
  ReportOutcome o;
  o.page = "monday/report.html";
  o.grade = "Good";
  o.headline = "Good: every check passed.";
  return o;
}

TEST(ClosingLines, areVerdictWhatToDoAndWhereTheReportIs) {
  const auto lines = closing_lines(good(), "");
  EXPECT_EQ(lines[0], "verdict: Good: every check passed.");
  EXPECT_EQ(lines[1], "to do: nothing, these poses can be used as they are");
  EXPECT_EQ(lines[2], "report: monday/report.html");
}

TEST(ClosingLines, haveTheWorstReasonAndSayThatThereAreMore) {
  ReportOutcome care = good();
  care.grade = "Usable with care";
  care.reasons = {"it drifts by 3.0 % of the distance", "the calibration can be improved"};
  care.advice = {"Drive turns."};
  const auto lines = closing_lines(care, "");
  EXPECT_EQ(lines[0],
            "verdict: Usable with care: it drifts by 3.0 % of the distance (and 1 more in the "
            "report)");
  EXPECT_EQ(lines[1], "to do: Drive turns.");
}

TEST(ClosingLines, ofADriveWithoutAUsablePoseSayNotToUseIt) {
  ReportOutcome bad = good();
  bad.grade = "Do not use";
  bad.usable = false;
  bad.reasons = {"left and right are swapped"};
  bad.main_reason = "left and right are swapped (24 of 24 frames)";
  EXPECT_EQ(closing_lines(bad, "")[0],
            "verdict: do not use these poses: left and right are swapped (24 of 24 frames)");
}

TEST(ClosingLines, withoutAReportSayWhy) {
  const auto lines = closing_lines({}, "monday: the disk is full");
  EXPECT_EQ(lines[0], "verdict: not known, there is no report");
  EXPECT_EQ(lines[2], "report: monday: the disk is full");
}

}  // namespace
}  // namespace vergence::app
