#include "app/report/findings.hpp"

#include <gtest/gtest.h>

namespace vergence::app::report {
namespace {

TEST(Findings, noneIsAGoodDrive) {
  const Verdict v = Findings().verdict();
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_TRUE(v.usable);
  EXPECT_TRUE(v.reasons.empty());
}

TEST(Findings, theWorstReasonsComeFirstAndEqualOnesAsTheyWereFound) {
  Findings f;
  f.find(Grade::care, "first");
  f.find(Grade::bad, "worst");
  f.find(Grade::care, "second");
  const Verdict v = f.verdict();
  EXPECT_EQ(v.grade, Grade::bad);
  EXPECT_EQ(v.reasons, (std::vector<std::string>{"worst", "first", "second"}));
  EXPECT_TRUE(v.usable) << "a bad grade alone does not make every pose useless";
}

TEST(Findings, theFirstReasonToGiveUpStandsWithItsAdvice) {
  Findings f;
  f.give_up("the lens is another", "Calibrate it.");
  f.give_up("no pose is ok", "");
  const Verdict v = f.verdict();
  EXPECT_FALSE(v.usable);
  EXPECT_EQ(v.main_reason, "the lens is another. Calibrate it.");
}

}  // namespace
}  // namespace vergence::app::report
