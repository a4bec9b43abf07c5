#include "core/calibration/pairing_evidence.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/math/random.hpp"
#include "core/math/so3.hpp"

namespace vergence::calibration {
namespace {

constexpr Pinhole kLens{500, 500, 320, 240};
constexpr std::size_t kPoints = 150;

/// Disturbance of a drive of 40 frames from frame 20 on.
struct Case {
  std::string name;
  // Forward motion per frame, with a nod of 3 mrad.
  double step_m = 0.3;
  int camera_late = 0, left_late = 0;
  // Pitch of the knock.
  double knock_rad = 0;
  int wanted = 0;
};

Transform T_world_left(const Case& c, int frame) {
  return {exp_so3({c.step_m > 0 ? 3e-3 * std::sin(1.3 * frame) : 0, 0, 0}),
          {0, 0, c.step_m * frame}};
}

Vec2 pixel(const Vec3& X, Random* random) {
  return {kLens.fx * X.x() / X.z() + kLens.cx + 0.15 * random->normal(),
          kLens.fy * X.y() / X.z() + kLens.cy + 0.15 * random->normal()};
}

struct Seen {
  // True if a lag was reported before the fault.
  bool before = false;
  // Lag in the last frame of the fault.
  int lag = 0;
  bool in_step_during = false;
  // Number of frames after the fault's end until the cameras are in sync again.
  int in_step_after = 0;
};

/// Twenty frames before the fault, twenty with it, and twenty after it.
Seen drive(const Case& c) {
  constexpr int kFrames = 60, kFault = 20, kEnd = 40;
  Arena arena;
  PairingEvidence evidence(kPoints, arena);
  Random random(7);
  const Transform T_right_left{exp_so3({0.002, -0.01, 0.003}), {-0.5, 0.01, 0}};
  std::vector<Vec3> world;
  for (std::size_t i = 0; i < kPoints; ++i)
    world.emplace_back(8 * random.uniform() - 4, 6 * random.uniform() - 3,
                       16 + 20 * random.uniform());
  Seen seen;
  for (int i = 0; i < kFrames; ++i) {
    const bool fault = i >= kFault && i < kEnd;
    const Transform left = T_world_left(c, i - (fault ? c.left_late : 0)).inverse(),
                    right = T_world_left(c, i - (fault ? c.camera_late : 0)).inverse();
    const Transform knock{exp_so3({fault ? c.knock_rad : 0, 0, 0}), Vec3::Zero()};
    std::vector<StereoObservation> points;
    for (std::size_t k = 0; k < kPoints; ++k)
      points.push_back({pixel(left * world[k], &random),
                        pixel(knock * (T_right_left * (right * world[k])), &random), 0.15,
                        static_cast<std::uint32_t>(k)});
    if (i == kFault) evidence.question();
    evidence.next(static_cast<std::uint64_t>(i + 1), points, {T_right_left, kLens, kLens});
    EXPECT_EQ(evidence.questioned() && evidence.cameras_in_sync(), false) << c.name;
    if (i < kFault) seen.before = seen.before || evidence.lag_frames() != 0;
    if (fault) seen.in_step_during = seen.in_step_during || evidence.cameras_in_sync();
    if (i == kEnd - 1) seen.lag = evidence.lag_frames();
    if (i >= kEnd && !evidence.cameras_in_sync()) ++seen.in_step_after;
  }
  return seen;
}

TEST(PairingEvidence, lagIsDistinguishedFromKnockAndStanding) {
  for (const Case& c : std::vector<Case>{{.name = "nothing"},
                                         {.name = "standing", .step_m = 0},
                                         {.name = "camera late", .camera_late = 1, .wanted = 1},
                                         {.name = "left late", .left_late = 1, .wanted = -1},
                                         {.name = "knocked", .knock_rad = 0.01},
                                         {.name = "knocked a little", .knock_rad = 0.002}}) {
    const Seen seen = drive(c);
    EXPECT_EQ(seen.lag, c.wanted) << c.name;
    EXPECT_FALSE(seen.before) << c.name;
    EXPECT_EQ(seen.in_step_during, c.wanted == 0 && c.step_m > 0 && c.knock_rad == 0) << c.name;
    // Four frames of motion are the fewest that are as certain as a lag.
    if (c.knock_rad == 0) {
      EXPECT_LE(seen.in_step_after, c.step_m > 0 ? 8 : 20) << c.name;
    }
  }
}

TEST(PairingEvidence, noiseOfAStandingRigIsNoLag) {
  Arena arena;
  PairingEvidence evidence(kPoints, arena);
  Random random(3);
  std::vector<StereoObservation> points(kPoints);
  for (int i = 0; i < 10'000; ++i) {
    for (std::uint32_t k = 0; k < kPoints; ++k) {
      const double x = 4.0 * k, y = 3.0 * k;
      points[k] = {{x + 0.5 * random.normal(), y + 0.5 * random.normal()},
                   {x - 5 + 0.5 * random.normal(), y + 0.5 * random.normal()},
                   0.5,
                   k};
    }
    evidence.next(static_cast<std::uint64_t>(i + 1), points,
                  {{Mat3::Identity(), {-0.5, 0, 0}}, kLens, kLens});
    ASSERT_EQ(evidence.lag_frames(), 0) << i;
    ASSERT_FALSE(evidence.suspected()) << i;
  }
}

TEST(PairingEvidence, distanceFromEpipolarLinesIsMeasured) {
  Arena arena;
  PairingEvidence evidence(kPoints, arena);
  const Transform T_right_left{Mat3::Identity(), {-0.5, 0, 0}};
  std::vector<StereoObservation> points;
  for (std::uint32_t k = 0; k < 40; ++k)
    points.push_back({Vec2(10.0 * k, 8.0 * k), Vec2(10.0 * k - 5, 8.0 * k + 2), 0.15, k});
  evidence.next(1, points, {T_right_left, kLens, kLens});
  // Two pixels across, shared by the two images.
  EXPECT_NEAR(evidence.distance_px(), std::sqrt(2.0), 1e-6);
}

}  // namespace
}  // namespace vergence::calibration
