// Conditions that last from the start or to the end; tests/system/faults has those that pass.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/math/random.hpp"
#include "tests/system/odometry/estimator_run.hpp"

namespace vergence::test {
namespace {

/// The image of a camera in the dark: black level and a grey level of noise.
features::test::Image dark_image(std::uint64_t seed) {
  // Both are in grey levels.
  constexpr double kBlackLevel = 6.0, kNoise = 1.0;
  features::test::Image p(640, 480);
  Random random(seed);
  for (std::uint8_t& b : p.bytes)
    b = static_cast<std::uint8_t>(
        std::clamp(std::lround(kBlackLevel + kNoise * random.normal()), 0L, 255L));
  return p;
}

TEST(OdometryInBadConditions, cameraCoveredForGoodIsNeverOkAgain) {
  constexpr std::size_t kCovered = 20;
  const std::array dark{dark_image(1), dark_image(2), dark_image(3), dark_image(4)};
  for (const std::size_t camera : {0U, 1U}) {
    EstimatorRun run(with_supplied(brief_drive().rig));
    run.process(brief_drive(), 0, brief_drive().size(), [&](std::size_t i, RigFrame* f) {
      if (i >= kCovered) f->images[camera] = dark[i % dark.size()].view();
      return true;
    });
    EXPECT_EQ(count_usable(run.results(), 0, kCovered), static_cast<int>(kCovered));
    EXPECT_EQ(count_usable(run.results(), kCovered, brief_drive().size()), 0) << run.describe();
    EXPECT_EQ(run.results().back().sample.reason, Reason::image_no_contrast);
    EXPECT_EQ(run.allocations(), 0U);
  }
}

TEST(OdometryInBadConditions, camerasSwappedFromTheStartGiveNoPose) {
  EstimatorRunOptions options = with_supplied(brief_drive().rig);
  // Online calibration would calibrate the swapped rig.
  options.options.online = false;
  EstimatorRun run(options);
  run.process(brief_drive(), 0, brief_drive().size(), [](std::size_t, RigFrame* f) {
    std::swap(f->images[0], f->images[1]);
    return true;
  });
  int swapped = 0;
  for (const FrameResult& r : run.results()) {
    EXPECT_EQ(r.sample.status, PoseStatus::lost) << run.describe();
    swapped += r.sample.reason == Reason::cameras_swapped ? 1 : 0;
  }
  EXPECT_GT(swapped, 0) << "somewhere on the way there is enough near the rig to detect it";
}

}  // namespace
}  // namespace vergence::test
