#include "app/report/analysis.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "core/math/so3.hpp"

namespace vergence::app::report {
namespace {

/// Frame interval in ns.
constexpr std::int64_t kStep = 100'000'000;
constexpr double kDegree = 0.017453292519943295;

/// A way of 0.5 m a frame that bends, in a camera's axes; n = 600 is 300 m.
Session bent_drive(std::size_t n) {
  Session s;
  for (std::size_t i = 0; i < n; ++i) {
    Frame f{.stamp = Stamp(static_cast<std::int64_t>(i) * kStep), .status = PoseStatus::ok};
    f.state = State::stereo_odometry;
    f.posed = true;
    const double angle = 0.005 * static_cast<double>(i), radius = 100;
    f.T_world_left = {
        exp_so3({0, angle, 0}),
        {radius * (1 - std::cos(angle)), 0.3 * std::sin(7 * angle), radius * std::sin(angle)}};
    s.frames.push_back(f);
  }
  return s;
}

Session with_reference(Session s, const Transform& T_reference_world) {
  for (const Frame& f : s.frames)
    if (f.posed) s.reference.push_back({f.stamp, T_reference_world * f.T_world_left});
  return s;
}

TEST(Analysis, aReferenceThatIsTheSameElsewhereGivesNoError) {
  // From the camera's axes to one with z up, turned and far away.
  Mat3 up;
  up << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Transform T{exp_so3({0, 0, 0.7}) * up, {400, -300, 60}};
  const Analysis a = analyse(with_reference(bent_drive(600), T));
  ASSERT_EQ(a.source, ErrorSource::reference);
  EXPECT_LT(a.horizontal.max, 1e-6);
  EXPECT_LT(a.vertical.max, 1e-6);
  EXPECT_LT(a.heading.max, 1e-5);
  EXPECT_NEAR(a.path_m, 300, 3);
  EXPECT_NEAR(a.interval_s, 0.1, 1e-12);
  EXPECT_FALSE(a.map_is_enu);
}

TEST(Analysis, driftAfterHundredMetresKeepsSizeAndSign) {
  Session s = with_reference(bent_drive(600), Transform{});
  // After 200 m, the pose is 2 m too high and turned left by 3°.
  for (std::size_t i = 400; i < 600; ++i) {
    s.frames[i].T_world_left.t.y() -= 2;
    s.frames[i].T_world_left.R = exp_so3({0, -3 * kDegree, 0}) * s.frames[i].T_world_left.R;
  }
  const Analysis a = analyse(s);
  EXPECT_NEAR(a.vertical_m[399], 0, 1e-9);
  EXPECT_NEAR(a.vertical_m[400], 2, 1e-9);
  EXPECT_NEAR(a.heading_deg[599], -3, 1e-6) << "clockwise is positive, as against an INS";
  EXPECT_NEAR(a.vertical.end, 2, 1e-9);
}

TEST(Analysis, withoutAReferenceThereAreNoErrorsAndItIsSaid) {
  Session other_time = with_reference(bent_drive(50), Transform{});
  for (StampedPose& p : other_time.reference) p.stamp = Stamp(p.stamp.ns() + 3'600'000'000'000);
  Session unplaced = with_reference(bent_drive(50), Transform{});
  for (Frame& f : unplaced.frames) f.has_ins = true, f.ins = {1, 2, 3};
  for (const auto& [session, why] :
       {std::pair(bent_drive(50), "no reference"),
        std::pair(other_time, "reference.tum and of the estimate do not overlap"),
        std::pair(unplaced, "no ENU alignment")}) {
    const Analysis a = analyse(session);
    EXPECT_EQ(a.source, ErrorSource::none);
    for (const auto* curve : {&a.horizontal_m, &a.vertical_m, &a.heading_deg})
      for (const double v : *curve) EXPECT_TRUE(std::isnan(v));
    EXPECT_NE(a.source_message.find(why), std::string::npos) << a.source_message;
  }
  EXPECT_FALSE(analyse(bent_drive(50)).drift.has_value());
  EXPECT_TRUE(analyse(unplaced).ins_unplaced);
}

TEST(Analysis, lostFramesHaveNoPlaceAndMissingOnesABreak) {
  Session s = bent_drive(100);
  for (std::size_t i = 40; i < 45; ++i)
    s.frames[i].posed = false, s.frames[i].status = PoseStatus::lost;
  s.frames.erase(s.frames.begin() + 70, s.frames.begin() + 80);
  const Analysis a = analyse(s);
  EXPECT_TRUE(std::isnan(a.estimate_x[42]));
  EXPECT_FALSE(std::isnan(a.estimate_x[45]));
  EXPECT_EQ(a.breaks[70], 1);
  EXPECT_EQ(std::count(a.breaks.begin(), a.breaks.end(), 1), 1);
  EXPECT_EQ(a.lost, 5U);
  EXPECT_NEAR(a.ok_share.value(), 85.0 / 90.0, 1e-12);
}

TEST(Analysis, errorsToTheInsAreThoseOfTheFile) {
  Session s = bent_drive(10);
  for (std::size_t i = 5; i < 10; ++i) {
    Frame& f = s.frames[i];
    f.placed = f.has_ins = f.compared = true;
    f.enu = {1, 2, 3}, f.ins = {4, 6, 3}, f.error = {-3, -4, -0.5};
    f.error_heading_deg = -1.5;
  }
  const Analysis a = analyse(s);
  EXPECT_EQ(a.source, ErrorSource::ins);
  EXPECT_TRUE(a.map_is_enu);
  EXPECT_TRUE(std::isnan(a.horizontal_m[4]));
  EXPECT_EQ(a.horizontal_m[7], 5);
  EXPECT_EQ(a.vertical_m[7], -0.5);
  EXPECT_EQ(a.heading.max, 1.5);
  EXPECT_EQ(a.reference_x[7], 4);
}

TEST(Analysis, driftAgainstInsUsesPositionsOnly) {
  Session s = bent_drive(600);
  Mat3 up;
  // These are the axes in ENU of a camera that looks east.
  up << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (Frame& f : s.frames) {
    const Vec3 p = exp_so3({0, 0, 0.4}) * up * f.T_world_left.t;
    f.placed = f.has_ins = f.compared = true;
    f.ins = {p.x(), p.y(), p.z()};
    // The alignment is bad, so its errors are large.
    f.enu = {0.9 * p.x(), p.y(), p.z()};
    f.error = {-0.1 * p.x(), 0, 0};
  }
  EXPECT_LT(analyse(s).drift.value(), 1e-9);
  // The path is two per cent too long.
  for (Frame& f : s.frames) f.T_world_left.t *= 1.02;
  const Analysis a = analyse(s);
  EXPECT_NE(a.drift_message.find("300 m"), std::string::npos);
  // 300 m of ours are an arc of 300/102 rad on a circle of 102 m; the ways differ by 2 m of radius
  // over its chord.
  EXPECT_NEAR(a.drift.value(), 2 * 2 * std::sin(150.0 / 102) / 300, 2e-4);
}

}  // namespace
}  // namespace vergence::app::report
