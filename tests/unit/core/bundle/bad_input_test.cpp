#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "tests/unit/core/bundle/bundle_fixture.hpp"

namespace vergence {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

SimulationOptions small() { return {.poses = 4, .points = 30}; }

/// Something that is wrong with a problem, which is refused for it.
struct Defect {
  const char* name;
  void (*spoil)(SimulatedRig*, BundleProblem*, BundleOptions*);
  BundleTermination termination = BundleTermination::invalid_input;
};

TEST(BadBundle, invalidProblemIsRefusedAndUnchanged) {
  constexpr BundleTermination kUndetermined = BundleTermination::rank_deficient;
  static const std::vector<std::uint8_t> none_constant(4, 0);
  for (const Defect& d : {
           Defect{"a point behind its camera",
                  [](auto*rig, auto*, auto*) {
                    rig->points[7] = rig->true_poses[0].inverse() * Vec3(0, 0, -5);
                  }},
           {"a point seen once",
            [](auto*rig, auto*p, auto*) {
              std::erase_if(rig->observations, [](const BundleObservation& o) {
                return o.point == 5 && !(o.pose == 2 && o.camera == 1);
              });
              p->observations = rig->observations;
            },
            kUndetermined},
           {"a pose without observations",
            [](auto*rig, auto*p, auto*) {
              std::erase_if(rig->observations,
                            [](const BundleObservation& o) { return o.pose == 3; });
              p->observations = rig->observations;
            },
            kUndetermined},
           {"a pixel that is no number",
            [](auto*rig, auto*, auto*) { rig->observations[11].x = kNaN; }},
           {"a sigma without end",
            [](auto*rig, auto*, auto*) { rig->observations[3].inverse_sigma = 0; }},
           {"a point that is no number", [](auto*rig, auto*, auto*) { rig->points[2].x() = kNaN; }},
           {"a rotation that is none",
            [](auto*rig, auto*, auto*) { rig->T_left_world[2].R *= 1.1; }},
           {"a length without a direction",
            [](auto*rig, auto*, auto*) { rig->T_camera_left[1].t.setZero(); }},
           {"a pixel whose square is not finite",
            [](auto*rig, auto*, auto*) { rig->observations[3].x = 1e200; }},
           {"a point that there is not",
            [](auto*rig, auto*, auto*) { rig->observations[9].point = 1000; }},
           {"a pose that there is not",
            [](auto*rig, auto*, auto*) { rig->observations[9].pose = 4; }},
           {"observations out of order",
            [](auto*rig, auto*, auto*) { std::swap(rig->observations[9], rig->observations[10]); }},
           {"an observation twice",
            [](auto*rig, auto*, auto*) { rig->observations[10] = rig->observations[9]; }},
           {"a transform too few",
            [](auto*, auto*p, auto*) { p->T_camera_left = p->T_camera_left.first(1); }},
           {"no pose that holds the others",
            [](auto*, auto*p, auto*) { p->pose_constant = none_constant; }},
           {"nothing", [](auto*, auto*p, auto*) { *p = BundleProblem{}; }},
           {"fewer cells than none", [](auto*, auto*, auto*o) { o->cells = -1; }},
           {"more cells than there can be", [](auto*, auto*, auto*o) { o->cells = 9; }},
           {"no shared errors", [](auto*, auto*, auto*o) { o->shared_errors = 0; }},
           {"shared errors that are no number",
            [](auto*, auto*, auto*o) { o->shared_errors = kNaN; }},
           {"steps without end", [](auto*, auto*, auto*o) { o->max_steps = 1001; }},
           {"a damping of nothing", [](auto*, auto*, auto*o) { o->initial_damping = 0; }},
           {"a measured length without a sigma",
            [](auto*, auto*, auto*o) {
              o->length[1].kind = BundleLength::measured;
              o->length[1].metres = 1;
              o->length[1].sigma = 0;
            }},
           {"a tenth parameter of a lens",
            [](auto*, auto*, auto*o) { o->intrinsics[1].free = 1U << kIntrinsicsSize; }},
       }) {
    SCOPED_TRACE(d.name);
    Simulated s(31, small());
    SimulatedRig& rig = s.rig;
    BundleProblem p = rig.problem();
    BundleOptions o = calibration_options();
    d.spoil(&rig, &p, &o);
    const std::vector<Vec3> points(p.points.begin(), p.points.end());
    const BundleResult r = s.own.adjuster.solve(p, o);
    EXPECT_EQ(r.termination, d.termination);
    EXPECT_FALSE(r.usable());
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_TRUE(points[i] == p.points[i] || points[i].hasNaN());
  }
}

TEST(BadBundle, unobservedPointIsUnchanged) {
  Simulated s(31, small());
  SimulatedRig& rig = s.rig;
  std::erase_if(rig.observations, [](const BundleObservation& o) { return o.point == 5; });
  const Vec3 before = rig.points[5];
  EXPECT_TRUE(s.own.adjuster.solve(rig.problem(), calibration_options()).converged());
  EXPECT_EQ(rig.points[5], before);
}

TEST(BadBundle, problemBeyondTheCapacityIsRefused) {
  SimulatedRig rig = Simulated(31, small()).rig;
  for (const int what : {0, 1, 2, 3, 4, 5}) {
    BundleCapacities c = capacities_for(small());
    if (what == 0) c.points = 29;
    if (what == 1) c.poses = 3;
    if (what == 2) c.observations = 239;
    if (what == 3) c.cameras = 1;
    if (what == 4) c.blocks = 15;
    if (what == 5) c.shared = false;
    OwnAdjuster tight(c);
    EXPECT_EQ(tight.adjuster.solve(rig.problem(), calibration_options()).termination,
              BundleTermination::capacity)
        << what;
    if (what == 5) {
      EXPECT_TRUE(tight.adjuster.solve(rig.problem(), {}).usable()) << "odometry alone";
    }
  }
}

TEST(BadBundle, poseWithTwoPointsIsRankDeficient) {
  Simulated s(31, small());
  SimulatedRig& rig = s.rig;
  std::erase_if(rig.observations, [](const BundleObservation& o) {
    return o.pose == 3 && (o.point > 1 || o.camera == 1);
  });
  rig.T_camera_left = rig.true_cameras;
  const BundleResult r = s.own.adjuster.solve(rig.problem(), {});
  EXPECT_EQ(r.termination, BundleTermination::rank_deficient);
  EXPECT_TRUE(rig.T_left_world[3].finite());
}

/// Random invalid problems give a named termination and finite results.
TEST(BundleFuzz, randomInvalidProblemsStayFinite) {
  SimulationOptions s{.poses = 5, .points = 20};
  OwnAdjuster own(capacities_for(s));
  int usable = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    Random random(seed);
    s.start_position = random.uniform(0, seed % 3 == 0 ? 30 : 1);
    s.start_translation = random.uniform(0, seed % 5 == 0 ? 10 : 0.3);
    s.start_rotation = random.uniform(0, seed % 7 == 0 ? 3 : 0.3);
    s.start_points = seed % 2 == 0 ? -1 : random.uniform(0, 20);
    SimulatedRig rig = simulate_rig(s, random);
    const double hostile[] = {kNaN,   std::numeric_limits<double>::infinity(), -1e308, 1e30, 0,
                              -1e-300};
    for (std::uint32_t i = random.below(4); i > 0; --i) {
      const double value = hostile[random.below(6)];
      BundleObservation& o =
          rig.observations[random.below(static_cast<std::uint32_t>(rig.observations.size()))];
      const std::function<void()> spoils[] = {
          [&] { o.x = value; },
          [&] { o.inverse_sigma = static_cast<float>(value); },
          [&] { rig.points[random.below(20)][random.below(3)] = value; },
          [&] { rig.T_left_world[random.below(5)].t[random.below(3)] = value; },
          [&] { rig.T_camera_left[random.below(2)].t[random.below(3)] = value; },
          [&] { o.point = random.next(); },
          [&] { std::erase_if(rig.observations, [&](auto&) { return random.below(3) == 0; }); },
          [&] { std::ranges::fill(rig.points, Vec3(rig.points[0])); },
      };
      spoils[random.below(8)]();
      if (rig.observations.empty()) break;
    }
    BundleOptions o{.configuration = static_cast<BundleConfiguration>(random.below(3)),
                    .loss = static_cast<BundleLoss>(random.below(3))};
    o.length[1].kind = static_cast<BundleLength>(random.below(3));
    o.length[1].metres = random.uniform(0.1, 1);
    o.length[1].sigma = random.uniform(1e-4, 1e-1);
    o.initial_damping = std::pow(10.0, random.uniform(-9, 2));
    o.covariance = o.pose_covariance = true;
    if (random.below(4) == 0) o.intrinsics[1].free = static_cast<std::uint16_t>(random.below(512));
    std::vector<Transform> images;
    std::vector<BundleObservation> per_image;
    std::vector<std::uint8_t> constant;
    const BundleProblem p = o.configuration == BundleConfiguration::parallel_monocular
                                ? monocular_problem(&rig, &images, &per_image, &constant)
                                : rig.problem();
    const BundleResult r = own.adjuster.solve(p, o);
    EXPECT_GE(r.steps, 0);
    EXPECT_LE(r.steps, o.max_steps);
    if (r.termination == BundleTermination::invalid_input ||
        r.termination == BundleTermination::capacity)
      continue;
    EXPECT_TRUE(std::isfinite(r.final_cost) && std::isfinite(r.rms_px)) << seed;
    for (const Vec3& point : p.points) EXPECT_TRUE(point.allFinite()) << seed;
    for (const Transform& T : p.T_left_world) EXPECT_TRUE(T.finite()) << seed;
    for (const Transform& T : p.T_camera_left) EXPECT_TRUE(T.finite()) << seed;
    EXPECT_TRUE(r.pose_covariance.allFinite()) << seed;
    for (const Mat6& m : r.covariance_total) EXPECT_TRUE(m.allFinite()) << seed;
    usable += r.usable() ? 1 : 0;
  }
  // The fuzz must reach the solver, not only its input check.
  EXPECT_GT(usable, 100);
}

}  // namespace
}  // namespace vergence
