// The estimator and its rig, on a corridor drawn ray by ray.
#include <gtest/gtest.h>

#include "tests/unit/core/estimator/corridor_drive.hpp"

namespace vergence {
namespace {

using Kind = EstimatorEvent::Kind;

/// Decisions are those of requested estimations; verifying_test covers refinements.
struct Drive : test::CorridorDrive {
  explicit Drive(CalibrationTrust trust) {
    options.trust = trust;
    options.calibration.intrinsics = calibration::IntrinsicsEstimation::fixed;
    if (trust != CalibrationTrust::none) return;
    given = corridor.rig();
    for (Transform& T : given.T_camera_left) T = {};
  }
  void drive(int first, int last) { drive(first, last, corridor.rig().T_camera_left); }
  void drive(int first, int last, const std::array<Transform, kMaxCameras>& rig) {
    for (int i = first; i < last; ++i) give(corridor.frame(i, rig));
    keep_requested();
  }
  void finish() {
    estimator->finish();
    note();
    keep_requested();
  }
  void keep_requested() {
    std::erase_if(decisions, [](const CalibrationDecision& d) { return d.is_refinement; });
  }
  /// State by state, as the events have it.
  [[nodiscard]] std::vector<State> way() const {
    std::vector<State> states;
    for (const EstimatorEvent& e : events) {
      if (e.kind != Kind::state) continue;
      if (states.empty()) states.push_back(e.from);
      EXPECT_EQ(states.back(), e.from) << "every transition begins where the last one ended";
      states.push_back(e.to);
    }
    return states;
  }
};

TEST(Calibrating, fromScratchReachesStereoOdometry) {
  Drive d(CalibrationTrust::none);
  d.begin();
  EXPECT_FALSE(d.estimator->calibrated());
  d.drive(0, 100);
  EXPECT_EQ(d.way(), (std::vector{State::initialising, State::parallel_monocular,
                                  State::calibrating, State::stereo_odometry}))
      << d.story;
  ASSERT_EQ(d.decisions.size(), 1U) << d.story;
  const CalibrationDecision& decision = d.decisions[0];
  EXPECT_TRUE(decision.accepted);
  EXPECT_STREQ(decision.reason, "");
  EXPECT_EQ(decision.cause, CalibrationCause::from_scratch);
  EXPECT_EQ(decision.calibration.frames, d.options.calibration.min_frames);
  EXPECT_GT(decision.held_out_after_px, 0);
  EXPECT_EQ(decision.held_out_before_px, 0) << "there was none before";
  EXPECT_TRUE(d.estimator->calibrated());
  EXPECT_EQ(d.count(Kind::calibration_accepted), 1);
  const Transform &found = d.estimator->calibration().T_camera_left[1],
                  &truth = d.corridor.rig().T_camera_left[1];
  const auto& sigma = d.estimator->calibration().sigma_noise[1];
  const Vec3 turn = log_so3(found.R * truth.R.transpose()), shift = found.t - truth.t;
  for (int i = 0; i < 3; ++i)
    EXPECT_LT(std::abs(turn[i]), 4 * sigma[static_cast<std::size_t>(i)]) << i;
  for (int i = 1; i < 3; ++i)
    EXPECT_LT(std::abs(shift[i]), 4 * sigma[static_cast<std::size_t>(i + 3)]) << i;
  // A pose on every frame, and ok only with a calibration.
  for (const PoseSample& s : d.samples) {
    EXPECT_NE(s.status, PoseStatus::lost) << d.story;
    EXPECT_EQ(s.status == PoseStatus::ok && s.state != State::stereo_odometry, false) << d.story;
  }

  EXPECT_EQ(d.samples.back().status, PoseStatus::ok) << d.story;
}

TEST(Calibrating, adoptionWaitsForSixConfirmingFrames) {
  const auto decided_at = [](int adopt_after) {
    Drive d(CalibrationTrust::none);
    d.options.calibration.adopt_after = adopt_after;
    d.begin();
    for (int i = 0; i < 60 && d.decisions.empty(); ++i) d.drive(i, i + 1);
    EXPECT_FALSE(d.decisions.empty()) << d.story;
    if (d.decisions.empty()) return std::int64_t{0};
    EXPECT_TRUE(d.decisions[0].accepted) << d.story;
    return (d.decisions[0].stamp.ns() - 1'000'000'000) / 50'000'000;
  };
  const std::int64_t six = decided_at(6);
  EXPECT_EQ(decided_at(4), six) << "fewer frames confirm nothing";
  EXPECT_EQ(decided_at(30), six) << "a confirmed solution does not wait";
}

// The frames before hold the first rig's calibration, the frames after hold another's, and no
// epipolar line shows a yaw: frames of both are never one solve, and those after confirm nothing
// that was found before. 10 mrad are 2.8 px here.
TEST(Calibrating, yawKnockDuringEstimationRestartsIt) {
  // The knock is after the first snapshot and before its solution is evaluated.
  constexpr int kKnock = 28;
  Drive d(CalibrationTrust::none);
  d.begin();
  d.drive(0, kKnock);
  auto knocked = d.corridor.rig().T_camera_left;
  knocked[1].R = exp_so3({0, 0.01, 0}) * knocked[1].R;
  d.drive(kKnock, 75, knocked);
  EXPECT_EQ(d.count(Kind::rig_changed), 1) << d.story;
  ASSERT_FALSE(d.decisions.empty()) << d.story;
  for (const CalibrationDecision& decision : d.decisions) {
    if (!decision.accepted) continue;
    const Mat3 R = decision.calibration.T_camera_left[1].R;
    EXPECT_LT(log_so3(R * knocked[1].R.transpose()).norm(), 0.003) << d.story;
  }
  EXPECT_TRUE(d.decisions.back().accepted) << d.story;
}

TEST(Calibrating, requestedCalibrationIsRejectedIfNoBetter) {
  Drive d(CalibrationTrust::given);
  d.begin();
  d.drive(0, 5);
  d.estimator->request_recalibration();
  EXPECT_EQ(d.estimator->state(), State::stereo_odometry) << "it acts at the next frame";
  d.drive(5, 66);
  EXPECT_EQ(d.way(), (std::vector{State::initialising, State::stereo_odometry, State::recalibrating,
                                  State::stereo_odometry}))
      << d.story;
  EXPECT_EQ(d.samples[6].state, State::recalibrating);
  EXPECT_EQ(d.samples[6].status, PoseStatus::degraded);
  EXPECT_EQ(d.samples[6].reason, Reason::recalibrating);
  ASSERT_EQ(d.decisions.size(), 1U) << d.story;
  EXPECT_EQ(d.decisions[0].cause, CalibrationCause::requested);
  EXPECT_GT(d.decisions[0].held_out_before_px, 0);
  // The one in use is the true one: a new one cannot fit better than by chance.
  EXPECT_FALSE(d.decisions[0].accepted) << d.story;
  EXPECT_EQ(d.estimator->calibration().T_camera_left[1].t, d.corridor.rig().T_camera_left[1].t);
  for (const PoseSample& s : d.samples) EXPECT_NE(s.status, PoseStatus::lost);
}

TEST(Calibrating, pitchKnockIsDetectedAndRecalibrated) {
  Drive d(CalibrationTrust::given);
  d.begin();
  std::array<Transform, kMaxCameras> knocked = d.corridor.rig().T_camera_left;
  // The pitch moves rows by 3.4 px.
  knocked[1] = perturbed(knocked[1], {0.012, 0, 0}, Vec3::Zero());
  d.drive(0, 12);
  d.drive(12, 85, knocked);
  EXPECT_EQ(d.way(), (std::vector{State::initialising, State::stereo_odometry, State::recalibrating,
                                  State::stereo_odometry}))
      << d.story;
  EXPECT_EQ(d.count(Kind::rig_changed), 1) << d.story;
  ASSERT_EQ(d.decisions.size(), 1U) << d.story;
  EXPECT_TRUE(d.decisions[0].accepted) << d.decisions[0].reason;
  EXPECT_GE(d.decisions[0].onset_frame, 12U);
  EXPECT_LT(d.decisions[0].held_out_after_px, d.decisions[0].held_out_before_px);
  EXPECT_NEAR(log_so3(d.estimator->calibration().T_camera_left[1].R * knocked[1].R.transpose()).x(),
              0.0, 1e-3);
  for (const PoseSample& s : d.samples) EXPECT_NE(s.status, PoseStatus::lost) << d.story;
}

TEST(Calibrating, offlineKeepsTheSuppliedCalibration) {
  Drive d(CalibrationTrust::given);
  d.options.online = false;
  d.begin();
  std::array<Transform, kMaxCameras> knocked = d.corridor.rig().T_camera_left;
  knocked[1] = perturbed(knocked[1], {0.012, 0, 0}, Vec3::Zero());
  d.drive(0, 5);
  d.drive(5, 20, knocked);
  d.estimator->request_recalibration();
  d.drive(20, 25, knocked);
  EXPECT_EQ(d.count(Kind::rig_changed), 0) << d.story;
  EXPECT_EQ(d.estimator->state(), State::stereo_odometry);
  EXPECT_TRUE(d.decisions.empty());
  EXPECT_EQ(d.count(Kind::calibration_verified) + d.count(Kind::calibration_contradicted), 0);
  for (const PoseSample& s : d.samples)
    EXPECT_NE(s.reason, Reason::unverified_calibration) << s.frame;
}

TEST(Calibrating, finishDecidesAPendingCalibrationOnce) {
  Drive d(CalibrationTrust::none);
  d.begin();
  d.drive(0, 29);
  EXPECT_TRUE(d.decisions.empty()) << d.story;
  d.finish();
  ASSERT_EQ(d.decisions.size(), 1U) << d.story;
  EXPECT_TRUE(d.decisions[0].accepted) << d.decisions[0].reason;
  d.estimator->finish();
  EXPECT_TRUE(d.estimator->calibrations().empty()) << "once";

  Drive too_short(CalibrationTrust::none);
  too_short.begin();
  too_short.drive(0, 8);
  too_short.estimator->finish();
  EXPECT_TRUE(too_short.estimator->calibrations().empty());
}

TEST(Calibrating, fromScratchNeedsABaselineLength) {
  Drive d(CalibrationTrust::none);
  d.given.baseline = 0;
  EXPECT_THROW(d.begin(), std::invalid_argument);
}

}  // namespace
}  // namespace vergence
