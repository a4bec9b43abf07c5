#include "app/report/fit_pattern.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/report/verdict.hpp"

namespace vergence::app::report {
namespace {

/// 8 × 6 cells of 100 matches whose distances are `middle` px at the centre and grow with the
/// square of the radius to `corner`.
void add_field(bool at_the_end, double middle, double corner, double scatter, Session* s) {
  for (int i = 0; i < 48; ++i) {
    ResidualRow r;
    r.at_the_end = at_the_end;
    r.width = 80, r.height = 80, r.left = i % 8 * 80.0, r.top = i / 8 * 80.0;
    const double radius = std::hypot(r.left + 40 - 320, r.top + 40 - 240) / std::hypot(320, 240);
    r.mean_px = (i % 2 == 0 ? 1 : -1) * (middle + (corner - middle) * radius * radius);
    r.matches = 100, r.scatter_px = scatter;
    s->residuals.push_back(r);
  }
}

Session session(double middle, double corner, double scatter) {
  Session s;
  add_field(true, middle, corner, scatter, &s);
  return s;
}

TEST(FitPattern, growsTowardsTheEdges) {
  EXPECT_EQ(fit_of(Session{}, true).pattern, FitPattern::unknown);
  EXPECT_EQ(fit_of(session(0.1, 0.4, 0.3), true).pattern, FitPattern::fine);
  EXPECT_EQ(fit_of(session(0.5, 3, 0.3), true).pattern, FitPattern::turned)
      << "near and far points alike";
  EXPECT_EQ(fit_of(session(0.5, 3, 0.7), true).pattern, FitPattern::lens);
  EXPECT_EQ(fit_of(session(3, 3, 0.7), true).pattern, FitPattern::fine)
      << "the same everywhere is no lens";
  EXPECT_EQ(fit_of(session(0.5, 3, 0.7), false).pattern, FitPattern::unknown);
  const Fit fit = fit_of(session(0.5, 3, 0.7), true);
  EXPECT_LT(fit.middle_px, fit.edge_px);
  EXPECT_NEAR(fit.scatter_px, 0.7, 1e-9);
}

TEST(FitPattern, tooFewMatchesSayNothing) {
  Session s = session(0.5, 3, 0.7);
  for (ResidualRow& r : s.residuals) r.matches = 3;
  EXPECT_EQ(fit_of(s, true).pattern, FitPattern::unknown);
}

/// A hundred frames, posed, of one status, with the residuals of a wrong lens.
Session drive(PoseStatus status, bool at_the_end) {
  Session s;
  s.reasons = {"", "unverified_calibration"};
  for (int i = 0; i < 100; ++i) {
    Frame f;
    f.stamp = Stamp(i * std::int64_t{100'000'000});
    f.posed = true;
    f.status = status;
    f.reason = status == PoseStatus::ok ? 0 : 1;
    s.frames.push_back(f);
  }
  s.summary = {{"calibration", {{"verified", !at_the_end}}}};
  add_field(at_the_end, 0.5, 3, 0.7, &s);
  if (!at_the_end) add_field(true, 0.03, 0.05, 0.25, &s);
  return s;
}

TEST(FitPattern, aWrongLensIsNotToBeUsedUntilTheDriveHasFoundIt) {
  for (const PoseStatus status : {PoseStatus::degraded, PoseStatus::ok}) {
    const Session s = drive(status, true);
    const Verdict v = judge(s, analyse(s));
    EXPECT_EQ(v.grade, Grade::bad);
    EXPECT_FALSE(v.usable);
    EXPECT_NE(v.sentence.find("esiduals grow towards the edges of the image"), std::string::npos)
        << v.sentence;
    EXPECT_NE(v.sentence.find(": the lens"), std::string::npos) << v.sentence;
  }
  const Session found = drive(PoseStatus::ok, false);
  const Verdict v = judge(found, analyse(found));
  EXPECT_EQ(v.grade, Grade::care);
  EXPECT_TRUE(v.usable);
  EXPECT_NE(v.sentence.find("he lens numbers given are wrong"), std::string::npos) << v.sentence;
}

}  // namespace
}  // namespace vergence::app::report
