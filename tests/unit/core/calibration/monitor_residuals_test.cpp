#include "core/calibration/detail/monitor_residuals.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/core/calibration/feature_log.hpp"
#include "tests/unit/core/calibration/monitor_trial.hpp"

namespace vergence::test {
namespace {

using namespace calibration::detail;
using calibration::MonitorFrame;

Reference reference_of(const FeatureDriveOptions& o, const Transform& T) {
  return {EpipolarGeometry(T), o.left, o.right};
}

struct Sums {
  Evidence stereo;
  double spread_now = 0, spread_life = 0;
  int frames = 0;
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
    // Tracks of the first frames have not reached their full age.
    if (i < 30 || !a.usable) continue;
    ++sums.frames;
    sums.stereo.add(a.evidence);
    sums.spread_now += a.spread_now;
    sums.spread_life += a.spread_life;
  }
  return sums;
}

/// |g − A θ| over |g|, both in the metric of A⁻¹: 0 where the derivatives are right and the
/// observations exact.
double misfit(const Evidence& e, const Vec5& theta) {
  return std::sqrt(gain(e.A, e.g - e.A * theta) / gain(e.A, e.g));
}

TEST(MonitorLooks, gradientsPointToTheTruthInEveryParameter) {
  for (int i = 0; i < kTheta; ++i) {
    SCOPED_TRACE(i);
    Vec5 theta = Vec5::Zero();
    theta[i] = 1e-4;
    FeatureDriveOptions o = exact_drive();
    const Transform T_reference = o.T_right_left;
    o.T_right_left = moved_on_sphere(T_reference, theta);
    const Sums sums = watch(o, T_reference, 120);
    // Second order: 0.1 px against disparities of ten and more.
    EXPECT_LT(misfit(sums.stereo, theta), 0.05);
  }
}

TEST(MonitorLooks, spreadIsTheLifeOfATrackForLastingErrors) {
  FeatureDriveOptions o = exact_drive();
  o.white_px = 0.5;
  o.sigma_px = 0.5;
  const Sums white = watch(o, o.T_right_left, 400);
  EXPECT_NEAR(white.spread_now / white.frames, 1.0, 0.1);
  EXPECT_NEAR(white.spread_life / white.frames, 1.0, 0.2);
  o.white_px = 0;
  o.constant_px = 0.5;
  const Sums lasting = watch(o, o.T_right_left, 400);
  EXPECT_NEAR(lasting.spread_now / lasting.frames, 1.0, 0.1);
  // Lives uniform in 5 … 20: Σ n²/Σ n = 14.2, less for tracks that leave the image.
  EXPECT_GT(lasting.spread_life / lasting.frames, 9.0);
  EXPECT_LT(lasting.spread_life / lasting.frames, 15.0);
}

TEST(MonitorLooks, outliersHaveNoWeight) {
  FeatureDriveOptions clean;
  clean.outliers = clean.movers = 0;
  FeatureDriveOptions dirty = clean;
  dirty.outliers = 0.1, dirty.movers = 0.1;
  const Sums a = watch(clean, clean.T_right_left, 300), b = watch(dirty, dirty.T_right_left, 300);
  // In units of the sum's own sigma, inflation 6: outliers may not push the estimate.
  EXPECT_LT(gain(b.stereo.A, b.stereo.g) / 6, 25);
  EXPECT_NEAR(b.spread_now / b.frames, a.spread_now / a.frames, 0.15);
}

TEST(MonitorLooks, tooFewTracksAreNotUsable) {
  FeatureDriveOptions o;
  o.tracks = 20;
  const Sums sums = watch(o, o.T_right_left, 60);
  EXPECT_EQ(sums.frames, 0);
}

}  // namespace
}  // namespace vergence::test
