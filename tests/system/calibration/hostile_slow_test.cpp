// Images that do not hold a calibration: nothing false is adopted, and the state stays honest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/math/random.hpp"
#include "tests/system/calibration/course.hpp"
#include "tests/system/odometry/faults.hpp"

namespace vergence::test {
namespace {

const StereoDrive& street() {
  static const StereoDrive drive = film({}, 140);
  return drive;
}

/// Whatever was adopted is right, as from 25 frames; nothing called ok is wrong.
void expect_nothing_false(const Course& course) {
  for (const Decided& d : course.decisions()) {
    if (!d.decision.accepted) continue;
    const RigError e = rig_error(d.decision.calibration, 1, street().rig.T_camera_left[1]);
    EXPECT_LT(e.rotation, 0.25e-3) << to_string(e) << '\n' << course.story();
    EXPECT_LT(std::abs(e.t.y()), 2.5e-3) << to_string(e) << '\n' << course.story();
    EXPECT_LT(std::abs(e.t.z()), 8e-3) << to_string(e) << '\n' << course.story();
  }
  EXPECT_EQ(wrong_ok(course.answers(), {}), "") << course.story();
}

TEST(HostileSlow, aCoveredLensFromTheStartCalibratesNothing) {
  for (const Cover side : {Cover::left, Cover::right, Cover::both}) {
    Course course(from_scratch(street().rig));
    course.give(street(), 0, 80, cover(street(), side, 0, 80));
    course.finish();
    EXPECT_TRUE(course.decisions().empty()) << course.story();
    EXPECT_EQ(course.estimator().state(), State::initialising);
    for (const Answer& a : course.answers())
      EXPECT_EQ(a.sample.status, PoseStatus::lost) << course.story();
  }
}

TEST(HostileSlow, aLensCoveredOnTheWayDelaysTheCalibrationOnly) {
  for (const Cover side : {Cover::left, Cover::right}) {
    Course course(from_scratch(street().rig));
    course.give(street(), 0, 140, cover(street(), side, 15, 35));
    expect_nothing_false(course);
    EXPECT_EQ(course.count_accepted(), 1) << course.story();
  }
}

TEST(HostileSlow, aLensCoveredWithACalibrationInUseIsNoKnock) {
  for (const Cover side : {Cover::left, Cover::right}) {
    Course course(with_calibration(street().rig));
    course.give(street(), 0, 120, cover(street(), side, 40, 80));
    expect_nothing_false(course);
    EXPECT_EQ(course.first(EstimatorEvent::Kind::rig_changed), nullptr) << course.story();
    EXPECT_EQ(count_ok(course.answers(), 40, 80), 0) << course.story();
  }
}

/// What is left of a picture at night: one grey level in thirty, and the sensor's noise.
Edit night(std::size_t first, std::size_t last) {
  const auto pictures = std::make_shared<std::array<Picture, 2>>();
  return [=](std::size_t i, RigFrame* frame) {
    if (i < first || i >= last) return true;
    for (std::size_t k = 0; k < 2; ++k) {
      const Picture& day = street().pairs[i][k];
      Picture& p = (*pictures)[k];
      if (p.bytes.empty()) p = Picture(day.width, day.height);
      Random noise(2 * i + k);
      for (std::size_t b = 0; b < day.bytes.size(); ++b)
        p.bytes[b] = static_cast<std::uint8_t>(
            std::clamp(std::lround(day.bytes[b] / 30.0 + 2 + 1.5 * noise.normal()), 0L, 255L));
      frame->images[k] = p.view();
    }
    return true;
  };
}

TEST(HostileSlow, atNightNothingFalseIsFound) {
  Course course(from_scratch(street().rig));
  course.give(street(), 0, 70, night(0, 70));
  course.finish();
  expect_nothing_false(course);
  Course falling(with_calibration(street().rig));
  falling.give(street(), 0, 110, night(40, 110));
  expect_nothing_false(falling);
  EXPECT_EQ(falling.count_accepted(), 0) << falling.story();
}

/// A textured side of a bus 6 m away drives through both images and fills most of them.
Edit bus(std::size_t first, std::size_t last) {
  const auto pictures = std::make_shared<std::array<Picture, 2>>();
  return [=](std::size_t i, RigFrame* frame) {
    if (i < first || i >= last) return true;
    const Intrinsics& lens = street().rig.intrinsics[0];
    const int disparity = static_cast<int>(lens.fx * street().rig.baseline / 6.0), length = 1400;
    const int nose = 1100 - 14 * static_cast<int>(i - first);  // 2 m/s across the view
    for (std::size_t k = 0; k < 2; ++k) {
      Picture& p = (*pictures)[k] = street().pairs[i][k];
      for (int y = 60; y < 700; ++y)
        for (int x = 0; x < p.width; ++x) {
          const int on = x + (k == 1 ? disparity : 0) - nose;
          if (on < 0 || on >= length) continue;
          const auto hash = static_cast<std::uint32_t>((on / 9) * 73856093) ^
                            static_cast<std::uint32_t>((y / 9) * 19349663);
          p.bytes[static_cast<std::size_t>(y * p.stride + x)] =
              static_cast<std::uint8_t>(40 + (hash * 2654435761U >> 25U));
        }
      frame->images[k] = p.view();
    }
    return true;
  };
}

TEST(HostileSlow, aBusThatFillsTheViewIsNoKnockAndCalibratesNothingFalse) {
  Course from_nothing(from_scratch(street().rig));
  from_nothing.give(street(), 0, 140, bus(10, 70));
  from_nothing.finish();
  expect_nothing_false(from_nothing);
  Course calibrated(with_calibration(street().rig));
  calibrated.give(street(), 0, 140, bus(40, 100));
  expect_nothing_false(calibrated);
}

}  // namespace
}  // namespace vergence::test
