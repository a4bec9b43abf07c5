#include "core/comparison/comparison.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace vergence {
namespace {

const Geodetic kOrigin{-27.4975, 153.0137, 60};
constexpr double kDegree = std::numbers::pi / 180.0;

/// A drive over the ground as a smooth function of time: body (forward, left, up) of the INS in
/// enu. About 10 m/s.
Transform T_enu_ins(double t) {
  const double w = 0.05;
  const Vec3 p(200 * std::sin(w * t), 150 * (1 - std::cos(w * t)), 3 * std::sin(0.5 * w * t));
  const Vec3 v(200 * w * std::cos(w * t), 150 * w * std::sin(w * t),
               1.5 * w * std::cos(0.5 * w * t));
  const double yaw = std::atan2(v.y(), v.x()), pitch = -std::atan2(v.z(), v.head<2>().norm());
  return {exp_so3({0, 0, yaw}) * exp_so3({0, pitch, 0}) * exp_so3({0.02 * std::sin(t), 0, 0}), p};
}

Stamp at(double t) { return Stamp(1403636584000000000) + Duration::seconds(t); }

struct Bench {
  ComparisonOptions options;
  Arena arena;
  LocalTangentPlane plane{kOrigin};
  Comparison comparison;
  std::vector<ComparedPose> out;

  explicit Bench(ComparisonOptions o = with_mount()) : options(o), comparison(o, arena) {}

  static ComparisonOptions with_mount() {
    return {.T_ins_left = mount_of({1.2, 0.4, -0.3}, {1 * kDegree, -2 * kDegree, 3 * kDegree})};
  }
  [[nodiscard]] Transform T_enu_left(double t) const { return T_enu_ins(t) * options.T_ins_left; }

  [[nodiscard]] InsSample sample(double t, const Vec3& shift = Vec3::Zero()) const {
    InsSample s{.stamp = at(t), .fix = FixStatus::fix_3d, .attitude_valid = true};
    const Transform T = T_enu_ins(t);
    s.position = plane.to_geodetic(T.t + shift);
    const Eigen::Quaterniond q = quaternion(plane.rotation_from(s.position).transpose() * T.R);
    s.q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
    s.position_sigma = s.height_sigma = 0.001;
    s.tilt_sigma = 1e-5;
    return s;
  }
  /// The odometry without any error: world is the left camera at t = 0.
  [[nodiscard]] PoseSample pose(double t, double scale = 1.0) const {
    PoseSample p{.stamp = at(t),
                 .status = PoseStatus::ok,
                 .T_world_left = T_enu_left(0).inverse() * T_enu_left(t)};
    p.T_world_left.t *= scale;
    return p;
  }
  void take() {
    ComparedPose c;
    while (comparison.next(&c)) out.push_back(c);
  }

  // Returns false if the sample is not sent.
  using EditSample = std::function<bool(double, InsSample*)>;
  using EditPose = std::function<void(double, PoseSample*)>;
  /// INS at 120 Hz, poses at 20 Hz, the pose a little before the INS samples around it.
  void drive(double from, double to, const EditSample& edit_sample = {},
             const EditPose& edit_pose = {}) {
    for (int i = static_cast<int>(std::lround(from * 120));
         i <= static_cast<int>(std::lround(to * 120)); ++i) {
      const double t = i / 120.0;
      if (i % 6 == 0) {
        PoseSample p = pose(t + 0.003);
        if (edit_pose) edit_pose(t, &p);
        comparison.add(p);
        take();
      }
      InsSample s = sample(t);
      if (!edit_sample || edit_sample(t, &s)) comparison.add(s);
      take();
    }
  }
  /// The INS at 120 Hz with the sample of each instant from `sample_at`, and poses at 40 Hz, each
  /// given `late_s` after its stamp.
  template <class SampleAt>
  void drive_by_samples(double seconds, double late_s, const SampleAt& sample_at) {
    for (int i = 0; i <= static_cast<int>(std::lround(seconds * 120)); ++i) {
      const double t = i / 120.0;
      comparison.add(sample_at(i, t));
      if (t >= late_s && i % 3 == 1) comparison.add(pose(t - late_s));
      take();
    }
  }
  void finish() {
    comparison.finish();
    take();
  }
};

TEST(MountOf, cameraAxesBecomeVehicleAxes) {
  const Transform T = mount_of({1, 2, 3}, Vec3::Zero());
  // A point seen ahead is ahead.
  EXPECT_LT((T * Vec3(0, 0, 5) - Vec3(6, 2, 3)).norm(), 1e-15);
  // A point seen on the right is on the right.
  EXPECT_LT((T * Vec3(5, 0, 0) - Vec3(1, -3, 3)).norm(), 1e-15);
  // A point seen below is below.
  EXPECT_LT((T * Vec3(0, 5, 0) - Vec3(1, 2, -2)).norm(), 1e-15);
  // A rig turned to the left by yaw sees ahead of it what lies ahead and left of the INS.
  EXPECT_LT(
      (mount_of(Vec3::Zero(), {0, 0, std::numbers::pi / 2}) * Vec3(0, 0, 1) - Vec3(0, 1, 0)).norm(),
      1e-15);
}

TEST(Comparison, idealInsAndTruePosesAgreeToAMillimetre) {
  Bench b;
  b.drive(0, 100);
  b.finish();
  ASSERT_EQ(b.out.size(), 2001U);
  ASSERT_EQ(b.comparison.alignment().revision, 1U);
  EXPECT_NEAR(b.comparison.alignment().distance, 100, 1);
  EXPECT_LT((b.comparison.plane().to_enu(kOrigin)).norm(), 1e-6);
  std::size_t compared = 0;
  for (const ComparedPose& c : b.out) {
    if (!c.compared) continue;
    ++compared;
    const double t = (c.pose.stamp - at(0)).to_seconds();
    EXPECT_LT(c.error_enu.norm(), 1e-3);
    EXPECT_LT(std::abs(c.error_yaw), 0.001 * kDegree);
    EXPECT_LT((c.reference.T_enu_left.t - b.T_enu_left(t).t).norm(), 1e-3);
    EXPECT_LT(rotation_angle(c.reference.T_enu_left.R.transpose() * b.T_enu_left(t).R),
              0.001 * kDegree);
    EXPECT_LT((b.plane.to_enu(c.estimate.position) - b.T_enu_left(t).t).norm(), 1e-3);
    EXPECT_FALSE(c.scale_disagrees);
  }
  // All but the first 100 m: about 10 s of 100 s, and the last frame, whose INS never came.
  EXPECT_GT(compared, 1750U);
  EXPECT_LT(compared, 1820U);
  EXPECT_EQ(compared, b.comparison.counters().compared);
  EXPECT_NEAR(b.out[1990].path_ratio, 1.0, 1e-5);
  EXPECT_EQ(b.out.back().ins, InsMatch::none);
}

TEST(Comparison, shortDriveIsAlignedAtItsEnd) {
  Bench b;
  b.drive(0, 4);
  EXPECT_EQ(b.comparison.alignment().revision, 0U);
  b.finish();
  ASSERT_EQ(b.comparison.alignment().revision, 1U);
  EXPECT_LT(
      (b.comparison.alignment().T_enu_world * b.pose(3).T_world_left.t - b.T_enu_left(3).t).norm(),
      1e-3);
}

TEST(Comparison, errorIsTheDriftSinceTheAlignment) {
  Bench b;
  // Drift in the world's axes from 50 s on, in m.
  const Vec3 drift(0.5, -0.25, 0.125);
  b.drive(0, 60, {}, [&](double t, PoseSample* p) {
    if (t > 50) {
      p->T_world_left.t += drift;
      p->T_world_left.R = exp_so3({0, -0.01, 0}) * p->T_world_left.R;
    }
  });
  const ComparedPose& c = b.out[b.out.size() - 2];
  ASSERT_TRUE(c.compared);
  EXPECT_LT((c.error_enu - b.T_enu_left(0).R * drift).norm(), 1e-3);
  // The world's y axis points down but for the mounting and the slope at the start; the view is
  // level but for them.
  EXPECT_NEAR(c.error_yaw, 0.01, 0.001);
  // The alignment is frozen.
  EXPECT_EQ(b.comparison.alignment().revision, 1U);
}

TEST(Comparison, posesDuringInsOutageAreNotCompared) {
  struct Away {
    const char* what;
    // Interval without a sample or without a fix, in s.
    double from, to;
    InsMatch match;
    bool no_fix = false;
  };
  for (const Away& away :
       {Away{"a gap", 20, 20.5, InsMatch::gap}, Away{"no fix", 20, 25, InsMatch::no_fix, true},
        Away{"a late start", -1, 20, InsMatch::none},
        Away{"an early end", 30, 99, InsMatch::none}}) {
    SCOPED_TRACE(away.what);
    Bench b;
    b.drive(0, 50, [&](double t, InsSample* s) {
      const bool outage = t > away.from && t < away.to;
      if (outage && away.no_fix) s->fix = FixStatus::none;
      return away.no_fix || !outage;
    });
    b.finish();
    EXPECT_EQ(b.out.size(), 1001U);
    EXPECT_EQ(b.comparison.counters().pushed_out, 0U);
    int seen = 0;
    for (const ComparedPose& c : b.out) {
      const double t = (c.pose.stamp - at(0)).to_seconds();
      if (t > away.from + 0.01 && t < away.to - 0.01) {
        EXPECT_EQ(c.ins, away.match) << t;
        EXPECT_FALSE(c.compared) << t;
        ++seen;
      } else if (t > (away.from < 0 ? away.to + 13 : 12) && t < 49.9 &&
                 (t < away.from || t > away.to + 0.01)) {
        EXPECT_TRUE(c.compared) << t;
        EXPECT_LT(c.error_enu.norm(), 1e-3);
      }
    }
    EXPECT_GE(seen, 9);
  }
}

TEST(Comparison, fixWithoutHeightCountsForEastAndNorthOnly) {
  Bench b;
  b.drive(0, 50, [](double t, InsSample* s) {
    if (t > 20 && t < 30) s->fix = FixStatus::fix_2d, s->position.height_m = 0;
    return true;
  });
  EXPECT_EQ(b.comparison.counters().jumps, 0U);
  for (const ComparedPose& c : b.out) {
    const double t = (c.pose.stamp - at(0)).to_seconds();
    if (t < 12 || !c.compared) continue;
    EXPECT_EQ(c.height_known, t < 20 || t > 30) << t;
    EXPECT_LT(c.error_enu.norm(), 1e-3) << t;
    EXPECT_FALSE(c.scale_disagrees) << t;
  }
  EXPECT_TRUE(b.out[b.out.size() - 2].compared);
}

TEST(Comparison, poseIsReleasedAfterTheMaximumWait) {
  Bench b;
  // No INS sample ever arrives.
  for (int i = 0; i < 20; ++i) b.comparison.add(b.pose(0.05 * i));
  b.take();
  // The newest pose is at 0.95 s; released are those more than 0.5 s older.
  EXPECT_EQ(b.out.size(), 9U);
  EXPECT_EQ(b.out.front().ins, InsMatch::none);
}

TEST(Comparison, fullQueueReleasesAndCountsTheOldest) {
  ComparisonOptions options = Bench::with_mount();
  options.max_wait = Duration::seconds(1e6);
  Bench b(options);
  for (int i = 0; i < 100; ++i) {
    b.comparison.add(b.pose(0.05 * i));
    b.take();
  }
  EXPECT_EQ(b.out.size(), 100U - Comparison::kPending + 1);
  EXPECT_EQ(b.comparison.counters().pushed_out, b.out.size());
}

TEST(Comparison, jumpOf100MetresIsCountedNotInterpolated) {
  Bench b;
  const Vec3 jump(0, 100, 0);
  b.drive_by_samples(40, 0.004,
                     [&](int, double t) { return b.sample(t, t > 30.0 ? jump : Vec3::Zero()); });
  EXPECT_EQ(b.comparison.counters().jumps, 1U);
  int jumped = 0;
  for (const ComparedPose& c : b.out) jumped += c.ins == InsMatch::jump ? 1 : 0;
  EXPECT_EQ(jumped, 1);
  EXPECT_TRUE(b.out.back().compared);
  EXPECT_NEAR(b.out.back().error_enu.norm(), 100, 1e-2);
}

/// A drive whose position leaps after reading `last_before`, with `without_fix` readings in
/// between.
void expect_placed_behind_a_leap(int last_before, int without_fix) {
  Bench b;
  const Vec3 jump(30, 100, 0);
  b.drive_by_samples(40, 0.004, [&](int i, double t) {
    InsSample s = b.sample(t, i > last_before ? jump : Vec3::Zero());
    if (i > last_before && i <= last_before + without_fix) s.fix = FixStatus::none;
    return s;
  });
  EXPECT_EQ(b.comparison.counters().jumps, 1U);
  ASSERT_TRUE(b.out.back().compared);
  EXPECT_LT(b.out.back().error_enu.norm(), 1e-3);
  EXPECT_GT((b.comparison.alignment().first - at(5.0)).ns(), 0);
  for (const ComparedPose& c : b.out) EXPECT_FALSE(c.scale_disagrees);
}

TEST(Comparison, jumpDuringAlignmentRestartsIt) {
  // Poses fall between readings 3n and 3n + 1: into the first jump, beside the second.
  for (const int last_before : {600, 601})
    for (const int without_fix : {0, 1, 3}) {
      SCOPED_TRACE(testing::Message() << last_before << ", without a fix " << without_fix);
      expect_placed_behind_a_leap(last_before, without_fix);
    }
}

/// Poses a second behind the INS, so that several leaps are known before the first pose meets one.
/// The alignment's 100 metres are driven after 10.15 s: between the first leap and the last.
TEST(Comparison, severalJumpsBeforeAPoseAreAllCounted) {
  const Vec3 first(30, 100, 0), second(-60, -100, 0);
  for (const Vec3& between : {first, second}) {
    Bench b;
    b.drive_by_samples(60, 1.004, [&](int, double t) {
      if (t <= 9.9 || t >= 10.6) return b.sample(t);
      return b.sample(t, t < 10.3 ? first : between);
    });
    EXPECT_EQ(b.comparison.counters().jumps, between == first ? 2U : 3U);
    ASSERT_TRUE(b.out.back().compared);
    EXPECT_LT(b.out.back().error_enu.norm(), 1e-3);
    EXPECT_GT((b.comparison.alignment().first - at(10.59)).ns(), 0);
    for (const ComparedPose& c : b.out) EXPECT_FALSE(c.scale_disagrees);
  }
}

TEST(Comparison, mapResetStartsANewAlignment) {
  Bench b;
  const Transform elsewhere{exp_so3({0, 0.3, 0}), {5, 0, 5}};
  b.drive(0, 60, {}, [&](double t, PoseSample* p) {
    if (t < 30) return;
    p->T_world_left = elsewhere * p->T_world_left;
    if (t < 31) p->reason = Reason::map_reset;
  });
  EXPECT_EQ(b.comparison.alignment().revision, 2U);
  ASSERT_TRUE(b.out[b.out.size() - 2].compared);
  EXPECT_LT(b.out[b.out.size() - 2].error_enu.norm(), 1e-3);
}

TEST(Comparison, lostPoseKeepsItsInsAndIsNotCompared) {
  Bench b;
  b.drive(0, 30, {}, [](double t, PoseSample* p) {
    if (t > 20 && t < 21) {
      p->status = PoseStatus::lost;
      p->T_world_left = {};
    }
  });
  for (const ComparedPose& c : b.out) {
    const double t = (c.pose.stamp - at(0)).to_seconds();
    if (t > 20.05 && t < 20.95) {
      EXPECT_FALSE(c.placed || c.compared);
      EXPECT_TRUE(c.ins_valid);
    }
  }
  EXPECT_LT(b.out[b.out.size() - 2].error_enu.norm(), 1e-3);
}

/// As a satellite receiver's: no attitude, the course while it moves.
bool only_course(double t, InsSample* s) {
  const Vec3 v = T_enu_ins(t + 1e-3).t - T_enu_ins(t - 1e-3).t;
  s->attitude_valid = false;
  s->q_enu_ins = {0, 0, 0, 1};
  s->heading_source = HeadingSource::course;
  s->yaw_enu = std::atan2(v.y(), v.x());
  return true;
}

TEST(Comparison, positionAndCourseAloneAreCompared) {
  ComparisonOptions o = Bench::with_mount();
  o.T_ins_left = mount_of({1.2, 0.4, 0}, Vec3::Zero());
  Bench b(o);
  b.drive(0, 60, only_course);
  const ComparedPose& c = b.out[b.out.size() - 2];
  ASSERT_TRUE(c.placed && c.compared);
  EXPECT_EQ(b.comparison.counters().ins_without_attitude, b.comparison.counters().ins_samples);
  // The lever arm is carried level: against the body's roll of up to 0.02 and pitch of 0.0075 that
  // errs by 0.4 * 0.02 + 1.2 * 0.0075 = 17 mm. The alignment's 100 m reach 18 m to the side, and
  // the end of the drive is 298 m to that side: 2 * 17 mm * 298 / 18 = 0.56 m.
  EXPECT_LT(c.error_enu.norm(), 0.56);
  EXPECT_LT(std::abs(c.error_yaw), 1 * kDegree);
  EXPECT_GT(b.comparison.alignment().rotation_sigma.head<2>().minCoeff(), 0);
}

TEST(Comparison, standstillKeepsTheLastCourse) {
  Bench b;
  const auto standing = [](double t, InsSample* s) {
    only_course(t, s);
    if (t < 1 || t > 2) s->heading_source = HeadingSource::none;
    return true;
  };
  b.drive(0, 3, standing);
  for (const ComparedPose& c : b.out) {
    const double t = (c.pose.stamp - at(0)).to_seconds();
    if (t < 0.9) {
      // No heading was known yet.
      EXPECT_NE(c.ins, InsMatch::ok) << t;
    } else if (t > 1.1) {
      EXPECT_EQ(c.ins, InsMatch::ok) << t;
    }
  }
}

TEST(Comparison, scaleErrorAboveTwoPercentIsReported) {
  for (const double scale : {1.0, 1.01, 1.03, 0.97}) {
    Bench b;
    b.drive(0, 60, {}, [&](double, PoseSample* p) { p->T_world_left.t *= scale; });
    const ComparedPose& c = b.out[b.out.size() - 2];
    EXPECT_NEAR(c.path_ratio, scale, 1e-4);
    EXPECT_EQ(c.scale_disagrees, std::abs(scale - 1) > 0.02);
  }
  // A receiver with a sigma of 2.5 m does not resolve 3 % of 200 m: 4 √2 2.5 / 200 = 7 %.
  Bench b;
  b.drive(
      0, 60, [](double, InsSample* s) { return s->position_sigma = 2.5, true; },
      [](double, PoseSample* p) { p->T_world_left.t *= 1.03; });
  EXPECT_FALSE(b.out[b.out.size() - 2].scale_disagrees);
}

TEST(Comparison, invalidSamplesAreRefusedAndCounted) {
  Bench b;
  b.comparison.add(b.sample(1.0));
  // The second sample has the same stamp, the third is older.
  b.comparison.add(b.sample(1.0));
  b.comparison.add(b.sample(0.5));
  EXPECT_EQ(b.comparison.counters().ins_refused, 2U);
  InsSample s = b.sample(1.1);
  std::swap(s.position.latitude_deg, s.position.longitude_deg);
  b.comparison.add(s);
  EXPECT_EQ(b.comparison.counters().ins_refused, 3U);
  s = b.sample(1.2);
  s.position.height_m = std::nan("");
  b.comparison.add(s);
  EXPECT_EQ(b.comparison.counters().ins_refused, 4U);
  s = b.sample(1.3);
  s.q_enu_ins = {0, 0, 0, 0};
  b.comparison.add(s);
  b.comparison.add(b.pose(1.25));
  b.take();
  ASSERT_EQ(b.out.size(), 1U);
  EXPECT_EQ(b.out[0].ins, InsMatch::no_fix);
}

TEST(Comparison, insClockSetBackIsAcceptedAfterASecond) {
  for (const int rate : {1, 4, 120, 400}) {
    SCOPED_TRACE(rate);
    ComparisonOptions options = Bench::with_mount();
    options.max_gap = Duration::seconds(1);
    Bench b(options);
    for (int i = 0; i < 10 * rate; ++i) b.comparison.add(b.sample(100 + double(i) / rate));
    for (int i = 0; i < 10 * rate; ++i) b.comparison.add(b.sample(double(i) / rate));
    EXPECT_EQ(b.comparison.counters().ins_restarts, 1U);
    // A second and the reading that ends it; at 1 Hz the three that there have to be.
    EXPECT_EQ(b.comparison.counters().ins_refused, static_cast<unsigned>(std::max(3, rate + 1)));
    b.comparison.add(b.pose(5));
    b.take();
    ASSERT_EQ(b.out.size(), 1U);
    EXPECT_EQ(b.out[0].ins, InsMatch::ok);
  }
}

}  // namespace
}  // namespace vergence
