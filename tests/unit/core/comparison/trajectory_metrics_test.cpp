#include "core/comparison/trajectory_metrics.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "core/math/random.hpp"

namespace vergence {
namespace {

constexpr double kPi = std::numbers::pi;
// Sums of some hundred terms of the order of a hundred metres in doubles.
constexpr double kRounding = 1e-11;

StampedPose pose(double seconds, const Vec3& t = Vec3::Zero(),
                 const Vec3& rotation_vector = Vec3::Zero()) {
  return {Stamp{} + Duration::seconds(seconds), {exp_so3(rotation_vector), t}};
}

/// A turn through space that holds every rotation.
std::vector<StampedPose> helix(int count) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < count; ++i) {
    const double a = 0.1 * i;
    poses.push_back(pose(a, {10 * std::cos(a), 10 * std::sin(a), 0.5 * a}, {0, 0, a}));
  }
  return poses;
}

std::vector<StampedPose> line(int count, double spacing, const Vec3& direction = Vec3::UnitX()) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < count; ++i) poses.push_back(pose(0.1 * i, spacing * i * direction));
  return poses;
}

std::vector<StampedPose> moved(const Transform& T, double scale, std::vector<StampedPose> poses) {
  for (StampedPose& p : poses)
    p.T_world_body = {T.R * p.T_world_body.R, T.R * (scale * p.T_world_body.t) + T.t};
  return poses;
}

TEST(Associate, poseIsInterpolatedAlongTheShorterArc) {
  // From +170° to −170° about z the short way leads over 180°.
  const std::vector<StampedPose> reference{pose(0, {0, 0, 0}, {0, 0, 170 * kPi / 180}),
                                           pose(0.1, {4, 2, 0}, {0, 0, -170 * kPi / 180})};
  const std::vector<StampedPose> estimate{pose(0.025, {7, 7, 7})};
  const MatchedTrajectories m = associate(estimate, reference, {});
  ASSERT_EQ(m.reference.size(), 1U);
  EXPECT_LT((m.reference[0].T_world_body.t - Vec3(1, 0.5, 0)).norm(), 1e-14);
  EXPECT_LT(
      rotation_angle(m.reference[0].T_world_body.R.transpose() * exp_so3({0, 0, 175 * kPi / 180})),
      1e-12);
  EXPECT_EQ(m.reference[0].stamp, estimate[0].stamp);
}

TEST(Associate, unmatchedPosesAreCountedByCause) {
  const std::vector<StampedPose> reference{pose(1.0, {1, 0, 0}), pose(1.2, {2, 0, 0}),
                                           pose(1.5, {3, 0, 0}), pose(1.6, {4, 0, 0})};
  const std::vector<StampedPose> estimate{pose(0.9), pose(1.0), pose(1.1), pose(1.3),
                                          pose(1.5), pose(1.6), pose(1.7)};
  EvaluationOptions options;
  // The first interval has exactly this length and is still bridged.
  options.max_gap = Duration::milliseconds(200);
  const MatchedTrajectories m = associate(estimate, reference, options);
  EXPECT_EQ(m.before, 1U);
  EXPECT_EQ(m.after, 1U);
  EXPECT_EQ(m.gap, 1U);
  ASSERT_EQ(m.reference.size(), 4U);
  EXPECT_DOUBLE_EQ(m.reference[0].T_world_body.t.x(), 1);
  EXPECT_DOUBLE_EQ(m.reference[1].T_world_body.t.x(), 1.5);
  // A reference with the same stamp matches despite the gap next to it.
  EXPECT_DOUBLE_EQ(m.reference[2].T_world_body.t.x(), 3);
  EXPECT_DOUBLE_EQ(m.reference[3].T_world_body.t.x(), 4);
}

TEST(Associate, nearestMatchesUpToTheLimitInclusive) {
  const std::vector<StampedPose> reference{pose(1.0, {1, 0, 0}), pose(1.1, {2, 0, 0})};
  const std::vector<StampedPose> estimate{pose(0.994), pose(0.995), pose(1.004), pose(1.05),
                                          pose(1.097), pose(1.105), pose(1.106)};
  EvaluationOptions options{.association = Association::nearest};
  const MatchedTrajectories m = associate(estimate, reference, options);
  ASSERT_EQ(m.reference.size(), 4U);
  const double expected[] = {1, 1, 2, 2};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_DOUBLE_EQ(m.reference[i].T_world_body.t.x(), expected[i]) << i;
  EXPECT_EQ(m.before, 1U);
  EXPECT_EQ(m.gap, 1U);
  EXPECT_EQ(m.after, 1U);
}

TEST(Associate, nanosecondsAtADateAreKept) {
  constexpr std::int64_t date = 1403636584763555584;
  std::vector<StampedPose> reference = line(2, 100.0), estimate = line(1, 0.0);
  reference[0].stamp = Stamp(date);
  // The step is smaller than a double's resolution at this date.
  reference[1].stamp = Stamp(date + 100);
  estimate[0].stamp = Stamp(date + 25);
  const MatchedTrajectories m = associate(estimate, reference, {});
  ASSERT_EQ(m.reference.size(), 1U);
  EXPECT_DOUBLE_EQ(m.reference[0].T_world_body.t.x(), 25);
}

TEST(Align, alignmentIsNeverAReflection) {
  const std::vector<StampedPose> reference = helix(80);
  std::vector<StampedPose> mirrored = reference;
  for (StampedPose& p : mirrored) p.T_world_body.t.z() *= -1.0;
  EXPECT_NEAR(align(mirrored, reference, AlignmentScale::one).R_reference_estimate.determinant(),
              1.0, kRounding);
  // A flat path leaves the sign of the third direction to the fit: it stays a rotation, too.
  std::vector<StampedPose> flat = reference;
  for (StampedPose& p : flat) p.T_world_body.t.z() = 0;
  const Alignment a =
      align(moved({exp_so3({0.1, 0.2, 3.0}), {1, 2, 3}}, 1.0, flat), flat, AlignmentScale::one);
  EXPECT_NEAR(a.R_reference_estimate.determinant(), 1.0, kRounding);
  EXPECT_FALSE(a.roll_unobservable);
  EXPECT_LT((a.R_reference_estimate * exp_so3({0.1, 0.2, 3.0}) - Mat3::Identity()).norm(),
            1e2 * kRounding);
}

TEST(Align, straightPathLeavesTheRollUnobservable) {
  Random random(3);
  std::vector<StampedPose> reference = line(50, 1.2, Vec3::UnitZ()), estimate = reference;
  for (StampedPose& p : estimate)
    p.T_world_body.t += 0.03 * Vec3(random.normal(), random.normal(), random.normal());
  EXPECT_TRUE(align(estimate, reference, AlignmentScale::one).roll_unobservable);
  EXPECT_TRUE(align(reference, reference, AlignmentScale::one).roll_unobservable);
}

TEST(Evaluate, scaledEstimateGivesPathRatioAndScale) {
  const std::vector<StampedPose> reference = helix(100);
  EvaluationOptions options{.segments = {{{10, 20}, 1, false}, {{10, 20}, 1, true}}};
  const TrajectoryEvaluation e =
      evaluate(moved({exp_so3({1, 2, 0}), {9, 9, 9}}, 1.02, reference), reference, options);
  ASSERT_EQ(e.status, EvaluationStatus::ok);
  EXPECT_NEAR(e.path_ratio, 1.02, kRounding);
  EXPECT_NEAR(e.sim3.scale, 1 / 1.02, kRounding);
  EXPECT_LT(e.ate_sim3.max, 1e-9);
  // The scale error is reported and not applied.
  EXPECT_GT(e.ate_se3.rmse, 0.1);
  EXPECT_GT(e.segments[0].translation, 0.015);
  EXPECT_LT(e.segments[1].translation, 1e-10);
  // The chord of 0.1 rad on a radius of 10 m, and its climb.
  EXPECT_NEAR(e.path_reference, 99 * std::hypot(20 * std::sin(0.05), 0.05), 1e-9);
}

TEST(Evaluate, cameraHeadingIsAboutItsWorldUp) {
  // In a camera's world (y down) a turn to the left, counter-clockwise from above, is negative
  // about y.
  std::vector<StampedPose> reference;
  for (int i = 0; i < 50; ++i)
    reference.push_back(
        pose(0.1 * i, {0.01 * i * i, 0.1 * std::sin(i), 1.0 * i}, {0, 0.02 * i, 0}));
  std::vector<StampedPose> estimate = reference;
  for (std::size_t i = 1; i < estimate.size(); ++i)
    estimate[i].T_world_body.R = exp_so3({0, -0.05, 0}) * estimate[i].T_world_body.R;
  TrajectoryEvaluation e = evaluate(estimate, reference, {});
  EXPECT_EQ(e.up_world, Vec3(-Vec3::UnitY()));
  EXPECT_NEAR(e.heading_start_aligned.last, 0.05, kRounding);

  // Camera in an enu world: up is z there, and the error is the same.
  const Transform T_enu_world{(Mat3() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished(), {100, 200, 30}};
  e = evaluate(moved(T_enu_world, 1.0, estimate), moved(T_enu_world, 1.0, reference), {});
  EXPECT_EQ(e.up_world, Vec3(Vec3::UnitZ()));
  EXPECT_NEAR(e.heading_start_aligned.last, 0.05, kRounding);
}

TEST(Evaluate, headingErrorWrapsToTheShorterArc) {
  std::vector<StampedPose> reference, estimate;
  for (int i = 0; i < 10; ++i) {
    const double yaw = i == 0 ? 0.0 : 3.1;
    reference.push_back(pose(0.1 * i, {1.0 * i, std::sin(i), 0}, {0, 0, yaw}));
    // A yaw of 3.2 is −3.08.
    estimate.push_back(pose(0.1 * i, {1.0 * i, std::sin(i), 0}, {0, 0, i == 0 ? 0.0 : yaw + 0.1}));
  }
  EvaluationOptions options{.axes = BodyAxes::forward_left_up};
  EXPECT_NEAR(evaluate(estimate, reference, options).heading_start_aligned.last, 0.1, kRounding);
}

TEST(Evaluate, knownDriftGivesTheEndErrors) {
  const std::vector<StampedPose> reference = line(101, 1.0);
  std::vector<StampedPose> estimate = reference;
  for (StampedPose& p : estimate) p.T_world_body.t *= 1.01;
  estimate.back().T_world_body.R = exp_so3({0, 0.02, 0});
  // The start alignment removes this transform.
  const Transform elsewhere{exp_so3({0, 0, 1}), {50, 50, 50}};
  const TrajectoryEvaluation e = evaluate(moved(elsewhere, 1.0, estimate), reference, {});
  EXPECT_NEAR(e.end_error_start_aligned, 1.0, 1e-9);
  EXPECT_NEAR(e.end_error_ratio, 0.01, 1e-11);
  EXPECT_NEAR(e.end_rotation_start_aligned, 0.02, 1e-9);
  // The alignment is centred and leaves half of the excess at either end.
  EXPECT_NEAR(e.end_error_se3, 0.5, 1e-9);
  EXPECT_TRUE(e.se3.roll_unobservable);
}

TEST(SegmentErrors, segmentEndsAtFirstPoseBeyondItsLength) {
  const std::vector<StampedPose> reference = line(12, 1.0);
  const std::vector<StampedPose> estimate = line(12, 1.01);
  SegmentOptions options{{10, 11, 5}, 1, false};
  const SegmentErrors s = segment_errors(estimate, reference, options);
  ASSERT_EQ(s.per_length.size(), 3U);
  // The segment ends at pose 11, because pose 10 is at 10 m and not beyond.
  EXPECT_EQ(s.per_length[0].count, 1U);
  EXPECT_NEAR(s.per_length[0].translation, 0.11 / 10, 1e-13);
  EXPECT_EQ(s.per_length[1].count, 0U);
  EXPECT_TRUE(std::isnan(s.per_length[1].translation));
  EXPECT_TRUE(std::isnan(s.per_length[1].rotation));
  EXPECT_EQ(s.per_length[2].count, 6U);
  EXPECT_NEAR(s.per_length[2].translation, 0.06 / 5, 1e-13);
  EXPECT_EQ(s.count, 7U);
  // The mean is over all segments and not over the means of the lengths.
  EXPECT_NEAR(s.translation, (0.11 / 10 + 6 * 0.06 / 5) / 7, 1e-13);
  EXPECT_NEAR(s.rotation, 0, 1e-13);

  EXPECT_NEAR(segment_errors(estimate, reference, options, 1 / 1.01).translation, 0, 1e-13);
  options.step = 4;
  // The segments start at poses 0 and 4.
  EXPECT_EQ(segment_errors(estimate, reference, options).per_length[2].count, 2U);
}

TEST(SegmentErrors, rotationErrorIsPerMetre) {
  const std::vector<StampedPose> reference = line(30, 1.0);
  std::vector<StampedPose> estimate = reference;
  for (std::size_t i = 0; i < estimate.size(); ++i)
    estimate[i].T_world_body.R = exp_so3({0.001 * static_cast<double>(i), 0, 0});
  const SegmentErrors s = segment_errors(estimate, reference, {{10}, 1, false});
  EXPECT_NEAR(s.rotation, 0.011 / 10, 1e-12);
}

TEST(Evaluate, insufficientInputGivesItsStatus) {
  const std::vector<StampedPose> reference = helix(50);
  EXPECT_EQ(evaluate({}, reference, {}).status, EvaluationStatus::no_match);
  EXPECT_EQ(evaluate(reference, {}, {}).status, EvaluationStatus::no_match);
  EXPECT_EQ(evaluate(std::span(reference).first(2), reference, {}).status,
            EvaluationStatus::too_few);
  EXPECT_EQ(evaluate(line(50, 0.0), reference, {}).status, EvaluationStatus::no_motion);
  EXPECT_EQ(evaluate(reference, line(50, 0.0), {}).status, EvaluationStatus::no_motion);
}

}  // namespace
}  // namespace vergence
