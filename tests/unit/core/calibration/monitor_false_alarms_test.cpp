#include <gtest/gtest.h>

#include <array>

#include "tests/support/quantile.hpp"
#include "tests/unit/core/calibration/monitor_modes.hpp"

namespace vergence::test {
namespace {

using test::quantile;

// An hour has this many frames at 30 Hz.
constexpr int kHour = 108000;

FeatureDriveOptions street(double speed) {
  FeatureDriveOptions o;
  o.speed = speed;
  o.tracks = 220;
  return o;
}

struct FiveReference {
  Mat5 covariance, root;
};
/// Covariance of θ's five after two seconds of driving.
FiveReference five_of(const FeatureDriveOptions& o) {
  const TrialReference reference = calibrated(o);
  Eigen::Matrix<double, 5, 6> back = Eigen::Matrix<double, 5, 6>::Zero();
  back.topLeftCorner<3, 3>().setIdentity();
  back.bottomRightCorner<2, 3>() =
      tangent_basis(o.T_right_left.t.normalized()).transpose() / o.T_right_left.t.norm();
  const Mat5 C = back * reference.covariance * back.transpose();
  return {C, Eigen::LLT<Mat5>(C).matrixL()};
}

TEST(MonitorModes, modesHaveTheStatisticsOfTracks) {
  const FeatureDriveOptions o = street(8);
  std::vector<double> tracks, modes;
  for (const std::uint64_t seed : {11U, 12U, 13U, 14U}) {
    FeatureDriveOptions drive = o;
    drive.seed = seed;
    MonitorTrial trial(drive);
    for (int i = 0; i < 1500; ++i)
      if (trial.step().statistic > 0 && i > 300) tracks.push_back(trial.verdict().statistic);
  }
  ModeDrive drive(o, 3);
  const auto windows = std::make_unique<calibration::detail::ChangeDetector>();
  windows->reset({}, Mat5::Zero());
  for (int i = 0; i < 60000; ++i) {
    const ModeDrive::Frame f = drive.next(Vec5::Zero());
    if (!f.moving) continue;
    windows->push(f.evidence);
    const double s = windows->decide().statistic;
    if (i > 300) modes.push_back(s);
  }
  // The slow error wanders over ten seconds: 160 s of tracks hold some sixteen draws of it, so a
  // third either way.
  for (const double share : {0.5, 0.9, 0.99}) {
    const double a = quantile(tracks, share), b = quantile(modes, share);
    EXPECT_LT(std::abs(a - b), 0.33 * b) << share;
  }
}

TEST(MonitorFalseAlarms, hundredHoursHaveAtMostFourAlarms) {
  constexpr std::array<double, 3> kSpeeds{3, 8, 15};
  std::vector<std::unique_ptr<ModeDrive>> drives;
  std::vector<FiveReference> references;
  for (const double speed : kSpeeds) {
    drives.push_back(
        std::make_unique<ModeDrive>(street(speed), 100 + static_cast<std::uint64_t>(speed)));
    references.push_back(five_of(street(speed)));
  }
  Random random(17);
  const calibration::MonitorOptions options;
  const auto windows = std::make_unique<calibration::detail::ChangeDetector>();
  int alarms = 0;
  for (int hour = 0; hour < 100; ++hour) {
    const std::size_t i = static_cast<std::size_t>(hour) % kSpeeds.size();
    Vec5 z;
    for (int k = 0; k < 5; ++k) z[k] = random.normal();
    // Every hour uses another calibration.
    const Vec5 error = references[i].root * z;
    windows->reset(options, references[i].covariance);
    int standing_over = 0;
    for (int n = 0; n < kHour; ++n) {
      const ModeDrive::Frame f = drives[i]->next(error);
      bool alarm = false;
      if (f.moving) {
        standing_over = 0;
        windows->push(f.evidence);
        alarm = windows->decide().kind != calibration::MonitorResult::Kind::quiet;
      } else {
        const double s = windows->single(f.evidence.evidence, f.spread_now);
        standing_over = s > options.threshold ? standing_over + 1 : 0;
        alarm = standing_over == options.collapse_frames;
      }
      if (!alarm) continue;
      ++alarms;
      windows->reset(options, references[i].covariance);
    }
  }
  EXPECT_LE(alarms, 4);
}

}  // namespace
}  // namespace vergence::test
