#include "core/comparison/mount.hpp"

#include <gtest/gtest.h>

#include "core/comparison/comparison.hpp"
#include "core/math/so3.hpp"
#include "drivers/mock/ins_model.hpp"
#include "tests/support/small_mock.hpp"

namespace vergence {
namespace {

constexpr Stamp kStart{1'000'000'000'000};
const Vec3 kLever(0.9, 0.375, 0.5);
// Boresight in rad.
const Vec3 kBoresight(0.02, -0.03, 0.05);

struct Drove {
  std::vector<StampedPose> estimate;
  std::vector<MountReference> reference;
};

struct How {
  mock::DriveKind kind = mock::DriveKind::loop;
  std::uint64_t seed = 1;
  bool ideal = false;
  bool velocity = true;
  // Delay of the reference's stamps.
  double late_s = 0;
  // Rate of the reference in Hz.
  double rate = 60;
  // Maximum shift of a reference sample and its stamp in either direction.
  double jitter_s = 0;
};

/// The left camera as an odometry would have it (in its own world, drifting a little), and the
/// mock's INS.
Drove drove(const How& how) {
  mock::DriveOptions options{.kind = how.kind, .seed = how.seed};
  const Transform T_body_left = mock::default_T_body_left();
  const Transform T_body_ins = T_body_left * mount_of(kLever, kBoresight).inverse();
  RigCalibration rig{.cameras = 2};
  const mock::RigTruth truth(test::empty_town(), options, rig, T_body_left, T_body_ins, {});
  const double length = truth.drive().duration().to_seconds();
  Drove d;
  Random random(how.seed, 40);
  // Frame rate in Hz.
  constexpr double kFrames = 20;
  const Transform T_enu_first = truth.camera_in_enu(0, {});
  Transform T_world_left, before = T_enu_first;
  for (double t = 0; t < length; t += 1 / kFrames) {
    const Transform now = truth.camera_in_enu(0, Duration::seconds(t));
    Transform motion = before.inverse() * now;
    if (!how.ideal) {
      motion.R = motion.R * exp_so3(5e-5 * Vec3(random.normal(), random.normal(), random.normal()));
      motion.t += 1e-3 * Vec3(random.normal(), random.normal(), random.normal());
    }
    T_world_left = T_world_left * motion;
    before = now;
    d.estimate.push_back({kStart + Duration::seconds(t), T_world_left});
  }
  mock::InsModel ins({how.ideal, how.seed, how.rate}, truth);
  const LocalTangentPlane plane(mock::kWorldOrigin);
  std::uint64_t number = 0;
  Random jitter(how.seed, 41);
  for (double even = -1; even < length + 1; even += 1 / how.rate) {
    const double t = even + how.jitter_s * jitter.uniform(-1, 1);
    const InsSample s = ins.sample(number++, Duration::seconds(t));
    const Mat3 R_enu_local = plane.rotation_from(s.position);
    MountReference r{.stamp = kStart + Duration::seconds(t + how.late_s)};
    r.T_enu_ref.R = R_enu_local * Eigen::Quaterniond(s.q_enu_ins.data()).toRotationMatrix();
    r.T_enu_ref.t = plane.to_enu(s.position);
    r.v_enu_ref = R_enu_local * Vec3(s.velocity_enu[0], s.velocity_enu[1], s.velocity_enu[2]);
    r.has_velocity = how.velocity;
    d.reference.push_back(r);
  }
  return d;
}

Mat3 nominal() { return mount_of(Vec3::Zero(), Vec3::Zero()).R; }

MountStatus estimate(const Drove& d, Mount* m) {
  return estimate_ins_extrinsics(d.estimate, d.reference, nominal(), {}, m);
}

/// Ground truth in Mount's parameters.
Vec3 true_turn() { return log_so3(mount_of(kLever, kBoresight).R * nominal().transpose()); }

TEST(Mount, slowReferenceGivesTheExtrinsics) {
  struct Slow {
    double rate, jitter_s;
  };
  // Readings that come every second, when the step is about over, and when none falls near its end.
  for (const Slow slow : {Slow{0.5, 0}, Slow{1, 0}, Slow{1.33, 0.01}, Slow{2, 0}, Slow{2, 0.005},
                          Slow{2.5, 0}, Slow{2.67, 0.005}, Slow{3, 0.005}}) {
    SCOPED_TRACE(testing::Message() << slow.rate << " Hz, jitter " << slow.jitter_s);
    const Drove d =
        drove({.ideal = true, .late_s = 0.012, .rate = slow.rate, .jitter_s = slow.jitter_s});
    Mount m;
    ASSERT_EQ(estimate(d, &m), MountStatus::ok);
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = static_cast<int>(k);
      const MountValue &turn = m.rotation[k], &arm = m.lever_arm[k];
      EXPECT_NEAR(turn.value, true_turn()[i], 3 * turn.sigma);
      EXPECT_NEAR(arm.value, kLever[i], 3 * arm.sigma);
      // Interpolation between frames limits the rotation sigma.
      EXPECT_LT(turn.sigma, 1e-3);
      EXPECT_LT(arm.sigma, 5e-3);
    }
    EXPECT_NEAR(m.clock_offset.value, 0.012, 3 * m.clock_offset.sigma);
    EXPECT_LT(m.clock_offset.sigma, 1e-4);
  }
}

/// Errors of thirty drives with an INS of the MTi-G's class, relative to the stated sigmas.
void sigmas_hold(bool velocity) {
  constexpr int kDrives = 30;
  std::array<std::vector<double>, 7> ratios;
  int heights = 0;
  for (int seed = 1; seed <= kDrives; ++seed) {
    const Drove d =
        drove({.kind = seed % 2 == 0 ? mock::DriveKind::loop : mock::DriveKind::figure_eight,
               .seed = static_cast<std::uint64_t>(seed),
               .velocity = velocity,
               .late_s = 0.02});
    Mount m;
    ASSERT_EQ(estimate(d, &m), MountStatus::ok) << seed;
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = static_cast<int>(k);
      if (m.rotation[k].observable)
        ratios[k].push_back((m.rotation[k].value - true_turn()[i]) / m.rotation[k].sigma);
      if (m.lever_arm[k].observable)
        ratios[3 + k].push_back((m.lever_arm[k].value - kLever[i]) / m.lever_arm[k].sigma);
    }
    if (m.lever_arm[2].observable) ++heights;
    if (m.clock_offset.observable)
      ratios[6].push_back((m.clock_offset.value - 0.02) / m.clock_offset.sigma);
  }
  // By position a car's small pitch and roll show no height; to the velocity the springs' quick
  // motion does.
  EXPECT_EQ(heights, velocity ? kDrives : 0);
  for (std::size_t k = 0; k < ratios.size(); ++k) {
    if (k == 5 && !velocity) continue;
    ASSERT_GE(ratios[k].size(), 20U) << "parameter " << k << " is seen on most drives";
    double sum = 0, worst = 0;
    for (const double r : ratios[k]) sum += r * r, worst = std::max(worst, std::abs(r));
    const double rms = std::sqrt(sum / static_cast<double>(ratios[k].size()));
    // The root mean square of 30 normal ratios is within 1 ± 0.4 at three sigma; a sigma up to
    // twice too large is still an honest one.
    EXPECT_GT(rms, 0.4) << "parameter " << k;
    EXPECT_LT(rms, 1.4) << "parameter " << k;
    EXPECT_LT(worst, 3.8) << "parameter " << k;
  }
}

TEST(Mount, sigmasMatchErrorsWithVelocity) { sigmas_hold(true); }
TEST(Mount, sigmasMatchErrorsByPositionAlone) { sigmas_hold(false); }

TEST(Mount, leverArmIsUnobservableOnAStraight) {
  const Drove d = drove({.kind = mock::DriveKind::straight, .velocity = false});
  Mount m;
  ASSERT_EQ(estimate(d, &m), MountStatus::ok);
  EXPECT_FALSE(m.lever_arm[0].observable) << m.lever_arm[0].sigma;
  EXPECT_FALSE(m.lever_arm[2].observable) << m.lever_arm[2].sigma;
  EXPECT_EQ(m.T_ref_est.t.x(), 0) << "no number";
}

/// The reference backwards in time, on its own stamps.
void reverse(std::vector<MountReference>* reference) {
  const Stamp begin = reference->front().stamp, end = reference->back().stamp;
  std::reverse(reference->begin(), reference->end());
  for (MountReference& r : *reference) {
    r.stamp = begin + (end - r.stamp);
    r.v_enu_ref = -r.v_enu_ref;
  }
}

TEST(Mount, unrelatedTrajectoriesDoNotConverge) {
  for (const mock::DriveKind kind : {mock::DriveKind::loop, mock::DriveKind::figure_eight})
    for (const bool velocity : {true, false}) {
      How how{.kind = kind, .velocity = velocity, .late_s = 1};
      Mount m{.moments = 77};
      Drove d = drove(how);
      EXPECT_EQ(estimate(d, &m), MountStatus::not_converged) << "a second late";
      how.late_s = 0;
      d = drove(how);
      reverse(&d.reference);
      EXPECT_EQ(estimate(d, &m), MountStatus::not_converged) << "reversed";
      how.seed = 2;
      how.kind = mock::DriveKind::straight;
      d.reference = drove(how).reference;
      EXPECT_EQ(estimate(d, &m), MountStatus::not_converged) << "another drive";
      EXPECT_EQ(m.moments, 77U);
    }
}

/// The residuals of 15 degrees that a fit may have at most: half their square is the two degrees
/// that count as seen.
TEST(Mount, swayingAttitudeDoesNotConverge) {
  How how{.ideal = true, .velocity = false};
  const auto swaying = [&](double degrees) {
    Drove d = drove(how);
    for (MountReference& r : d.reference) {
      const double t = (r.stamp - kStart).to_seconds();
      const double sway = std::sqrt(2.0) * degrees * M_PI / 180 * std::sin(2 * M_PI * t / 5);
      r.T_enu_ref.R = exp_so3(Vec3(0, 0, sway)) * r.T_enu_ref.R;
    }
    Mount m;
    return estimate(d, &m);
  };
  EXPECT_EQ(swaying(13), MountStatus::ok);
  EXPECT_EQ(swaying(18), MountStatus::not_converged);
}

TEST(Mount, insufficientDataGivesStatusAndKeepsResult) {
  How still;
  still.kind = mock::DriveKind::still;
  Drove d = drove(still);
  Mount m{.moments = 77};
  EXPECT_EQ(estimate(d, &m), MountStatus::no_motion);
  d.estimate.resize(10);
  EXPECT_EQ(estimate(d, &m), MountStatus::too_few);
  EXPECT_EQ(estimate_ins_extrinsics({}, {}, nominal(), {}, &m), MountStatus::too_few);
  d = drove({});
  for (MountReference& r : d.reference) r.stamp = r.stamp + Duration::seconds(1e6);
  EXPECT_EQ(estimate(d, &m), MountStatus::too_few) << "no time in common";
  // Three readings a second apart, and none for a dozen seconds: eighteen follow on another.
  How slow{.rate = 1};
  d = drove(slow);
  std::vector<MountReference> apart;
  for (std::size_t i = 0; i < d.reference.size(); ++i)
    if (i % 15 < 3) apart.push_back(d.reference[i]);
  d.reference = apart;
  EXPECT_EQ(estimate(d, &m), MountStatus::too_few);
  EXPECT_EQ(m.moments, 77U);
}

}  // namespace
}  // namespace vergence
