#include "core/calibration/detail/monitor_residuals.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/core/calibration/monitor_trial.hpp"

namespace vergence::test {
namespace {

using namespace calibration::detail;
using calibration::MonitorFrame;

Reference reference_of(const FeatureDriveOptions& o, const Transform& T) {
  return {T, EpipolarGeometry(T), tangent_basis(T.t.normalized()), T.t.norm(), o.left, o.right};
}

FeatureDriveOptions exact_street() {
  FeatureDriveOptions o;
  o.white_px = o.constant_px = o.walk_px = o.bias_px = o.outliers = o.movers = 0;
  return o;
}

struct Sums {
  Evidence stereo, motion;
  double spread_now = 0, spread_life = 0, spread_motion = 0;
  int frames = 0, looks = 0;
};

Sums watch(const FeatureDriveOptions& o, const Transform& T_reference, int frames) {
  const auto looks = std::make_unique<MonitorResiduals>();
  looks->reset();
  const Reference reference = reference_of(o, T_reference);
  MonitorTrial trial(o, T_reference, Mat6::Zero());
  Sums sums;
  for (int i = 0; i < frames; ++i) {
    (void)trial.step();
    const MonitorFrame& f = trial.frame();
    const StereoResiduals a = looks->stereo(reference, f, 30, true);
    if (i < 30 || !a.usable) continue;  // tracks of the first frames are not of full age
    ++sums.frames;
    sums.stereo.add(a.evidence);
    sums.spread_now += a.spread_now;
    sums.spread_life += a.spread_life;
    if (f.motion.empty()) continue;
    const MotionResiduals m = looks->motion(reference, f);
    if (!m.usable) continue;
    ++sums.looks;
    sums.motion.add(m.evidence);
    sums.spread_motion += m.spread;
  }
  return sums;
}

/// |g − A θ| over |g|, both in the metric of A⁻¹: 0 where the derivatives are right and the
/// observations exact.
double misfit(const Evidence& e, const Eigen::Matrix<double, kTheta, 1>& theta) {
  Theta rest = e.g;
  for (int i = 0; i < kTheta; ++i)
    for (int j = 0; j < kTheta; ++j)
      rest[static_cast<std::size_t>(i)] -= e.A[lower(std::max(i, j), std::min(i, j))] * theta[j];
  const Solved whole(e.A, e.g), left(e.A, rest);
  return std::sqrt((left.fixed_gain() + left.lag_gain()) / (whole.fixed_gain() + whole.lag_gain()));
}

TEST(MonitorLooks, gradientsPointFromTheReferenceToTheTruthInEveryParameter) {
  for (int i = 0; i < kTheta; ++i) {
    SCOPED_TRACE(i);
    Eigen::Matrix<double, kTheta, 1> theta = Eigen::Matrix<double, kTheta, 1>::Zero();
    theta[i] = i == kLag ? 0.02 : 1e-4;
    FeatureDriveOptions o = exact_street();
    const Transform T_reference = o.T_right_left;
    o.T_right_left = moved_on_sphere(T_reference, theta.head<kFixed>());
    if (i == kLag) o.lags = {{0, theta[kLag]}};
    const Sums sums = watch(o, T_reference, 120);
    ASSERT_GT(sums.looks, 5);
    // Second order: 0.1 px against disparities of ten and more, a fiftieth of image motions of up
    // to 100 px a frame.
    EXPECT_LT(misfit(sums.stereo, theta), 0.05);
    EXPECT_LT(misfit(sums.motion, theta), 0.05);
  }
}

TEST(MonitorLooks, motionSaysNothingOfWhatAPairMeasures) {
  // A point's place and its distance to the epipolar line are independent measurements: nothing is
  // counted twice.
  FeatureDriveOptions o = exact_street();
  const Transform T_reference = o.T_right_left;
  Vec5 theta = Vec5::Zero();
  theta[0] = 2e-4;  // pitch
  o.T_right_left = moved_on_sphere(T_reference, theta);
  const Sums pitch = watch(o, T_reference, 90);
  theta[0] = 0;
  theta[kYaw] = 2e-4;
  o.T_right_left = moved_on_sphere(T_reference, theta);
  const Sums yaw = watch(o, T_reference, 90);
  const auto gain = [](const Evidence& e) { return Solved(e.A, e.g).fixed_gain(); };
  EXPECT_LT(gain(pitch.motion), 0.01 * gain(pitch.stereo));
  EXPECT_GT(gain(yaw.motion), 5 * gain(yaw.stereo));
}

TEST(MonitorLooks, spreadOfWhiteErrorsIsOneAndOfLastingOnesTheLifeOfATrack) {
  FeatureDriveOptions o = exact_street();
  o.white_px = 0.5;
  o.sigma_px = 0.5;
  const Sums white = watch(o, o.T_right_left, 400);
  EXPECT_NEAR(white.spread_now / white.frames, 1.0, 0.1);
  EXPECT_NEAR(white.spread_life / white.frames, 1.0, 0.2);
  // Weights under one make A smaller: E ψ² E w / (E ψ')² = 0.87 for vectors of three, 0.96 for
  // numbers.
  EXPECT_NEAR(white.spread_motion / white.looks, 0.87, 0.15);
  o.white_px = 0;
  o.constant_px = 0.5;
  const Sums lasting = watch(o, o.T_right_left, 400);
  EXPECT_NEAR(lasting.spread_now / lasting.frames, 1.0, 0.1);
  // Lives uniform in 5 … 20: Σ n²/Σ n = 14.2, less for tracks that leave the image.
  EXPECT_GT(lasting.spread_life / lasting.frames, 9.0);
  EXPECT_LT(lasting.spread_life / lasting.frames, 15.0);
  EXPECT_LT(lasting.spread_motion / lasting.looks, 0.5);  // an error that stays is no motion
}

TEST(MonitorLooks, outliersWeighNothing) {
  FeatureDriveOptions clean;
  clean.outliers = clean.movers = 0;
  FeatureDriveOptions dirty = clean;
  dirty.outliers = 0.1, dirty.movers = 0.1;
  const Sums a = watch(clean, clean.T_right_left, 300), b = watch(dirty, dirty.T_right_left, 300);
  // In units of the sum's own sigma, inflation 6: outliers may not push the estimate.
  EXPECT_LT(Solved(b.stereo.A, b.stereo.g).fixed_gain() / 6, 25);
  EXPECT_LT(Solved(b.motion.A, b.motion.g).fixed_gain(), 25);
  EXPECT_NEAR(b.spread_now / b.frames, a.spread_now / a.frames, 0.15);
  EXPECT_NEAR(b.spread_motion / b.looks, a.spread_motion / a.looks, 0.25);
}

TEST(MonitorLooks, tooFewTracksSayNothing) {
  FeatureDriveOptions o;
  o.tracks = 20;
  const Sums sums = watch(o, o.T_right_left, 60);
  EXPECT_EQ(sums.frames, 0);
}

}  // namespace
}  // namespace vergence::test
