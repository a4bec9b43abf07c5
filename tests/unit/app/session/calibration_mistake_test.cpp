#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "app/session/calibration_mistake.hpp"
#include "app/session/match_sample.hpp"
#include "core/camera/camera.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "core/memory/arena.hpp"

namespace vergence::app {
namespace {

constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

RigCalibration rig_of_two(double k1 = -0.1) {
  RigCalibration rig;
  rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    rig.intrinsics[k] = {.width = 640,
                         .height = 480,
                         .fx = 500,
                         .fy = 500,
                         .cx = 320,
                         .cy = 240,
                         .distortion = {k1, 0, 0, 0, 0}};
  rig.T_camera_left[1] = {exp_so3({0.01, 0.003, -0.004}), {-0.5, 0.01, 0.02}};
  return rig;
}

/// Points all over both images as this rig sees them, without noise.
std::vector<RawMatch> matches_of(const RigCalibration& rig, int count) {
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[1]);
  Random random(3);
  std::vector<RawMatch> matches;
  while (static_cast<int>(matches.size()) < count) {
    const Vec2 at(639 * random.uniform(), 479 * random.uniform());
    Vec3 ray;
    Vec2 other;
    if (!left.unproject(at, &ray) ||
        right.project(rig.T_camera_left[1] * (ray * (10 + 40 * random.uniform())), &other,
                      nullptr) != ProjectStatus::ok)
      continue;
    RawMatch m;
    m.left = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    m.other = {static_cast<float>(other.x()), static_cast<float>(other.y())};
    m.frame = matches.size();
    matches.push_back(m);
  }
  return matches;
}

/// Fewer, each 0.2 px off.
std::vector<RawMatch> noisy_matches_of(const RigCalibration& rig) {
  std::vector<RawMatch> matches = matches_of(rig, 2000);
  for (RawMatch& m : matches) m.other[1] += m.frame % 2 == 0 ? 0.2F : -0.2F;
  return matches;
}

TEST(CalibrationMistake, theTrueRigHasNone) {
  const RigCalibration rig = rig_of_two(-0.3);
  EXPECT_EQ(find_mistake(noisy_matches_of(rig), rig, kAll), CalibrationMistake::none);
}

TEST(CalibrationMistake, aRotationGivenTransposedIsTold) {
  const RigCalibration rig = rig_of_two(-0.3);
  RigCalibration given = rig;
  given.T_camera_left[1].R.transposeInPlace();
  EXPECT_EQ(find_mistake(noisy_matches_of(rig), given, kAll),
            CalibrationMistake::rotation_transposed);
  EXPECT_EQ(find_mistake(noisy_matches_of(rig), given, 100), CalibrationMistake::none)
      << "a hundred matches are few";
}

TEST(CalibrationMistake, distortionOfImagesThatAreRectifiedIsTold) {
  EXPECT_EQ(find_mistake(noisy_matches_of(rig_of_two(0)), rig_of_two(-0.3), kAll),
            CalibrationMistake::already_rectified);
}

TEST(CalibrationMistake, aKnockIsNone) {
  const RigCalibration rig = rig_of_two(-0.3);
  RigCalibration knocked = rig;
  knocked.T_camera_left[1].R = exp_so3({0.006, 0, 0.01}) * rig.T_camera_left[1].R;
  EXPECT_EQ(find_mistake(noisy_matches_of(knocked), rig, kAll), CalibrationMistake::none);
}

/// A log whose every frame has so many observations; the left pixel counts them all.
class Drive {
 public:
  explicit Drive(std::size_t observations)
      : observations_(observations),
        arena_(calibration::TrackLog::memory_needed(3, observations) + 64),
        log_(3, observations, arena_) {}

  void frame(std::uint64_t number, unsigned cameras) {
    calibration::LoggedFrame f;
    f.number = number;
    log_.begin(f);
    for (std::size_t i = 0; i < observations_; ++i) {
      calibration::LoggedObservation s;
      s.cameras = static_cast<std::uint8_t>(cameras);
      s.raw[0] = {static_cast<float>(count_++), 0};
      log_.push(s);
    }
  }
  [[nodiscard]] const calibration::TrackLog& log() const { return log_; }

 private:
  std::size_t observations_, count_ = 0;
  Arena arena_;
  calibration::TrackLog log_;
};

std::vector<double> lefts(const MatchSample& sample) {
  std::vector<double> values;
  for (const RawMatch& m : sample.matches()) values.push_back(m.left[0]);
  return values;
}

TEST(MatchSample, takesEveryNewFrameOnce) {
  const auto sample = std::make_unique<MatchSample>();
  Drive drive(2);
  sample->take(drive.log());
  EXPECT_TRUE(sample->matches().empty());
  drive.frame(4, 3);
  sample->take(drive.log());
  sample->take(drive.log());
  drive.frame(9, 3);
  sample->take(drive.log());
  EXPECT_EQ(lefts(*sample), (std::vector<double>{0, 1, 2, 3}));
  EXPECT_EQ(sample->matches()[1].frame, 4U);
  EXPECT_EQ(sample->matches()[2].frame, 9U);
}

TEST(MatchSample, onlyWhatBothCamerasSeeIsAMatch) {
  const auto sample = std::make_unique<MatchSample>();
  Drive drive(1);
  for (const unsigned cameras : {1U, 2U, 6U}) {
    drive.frame(cameras, cameras);
    sample->take(drive.log());
  }
  EXPECT_TRUE(sample->matches().empty());
  drive.frame(7, 1U | 4U | 8U);
  sample->take(drive.log());
  ASSERT_EQ(sample->matches().size(), 2U);
  EXPECT_EQ(sample->matches()[0].camera, 2);
  EXPECT_EQ(sample->matches()[1].camera, 3);
}

TEST(MatchSample, aLongDriveIsSampledThinnerAndEvenly) {
  const auto sample = std::make_unique<MatchSample>();
  Drive drive(777);
  for (std::uint64_t i = 0; i < 130; ++i) {  // 101 010 matches: every eighth
    drive.frame(i, 3);
    sample->take(drive.log());
  }
  const std::vector<double> values = lefts(*sample);
  ASSERT_EQ(values.size(), 12'627U);
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(values[i], 8.0 * static_cast<double>(i));
}

}  // namespace
}  // namespace vergence::app
