#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <tuple>

#include "tests/system/odometry/faults.hpp"
#include "tests/system/odometry/mock_drive.hpp"

namespace vergence::test {
namespace {

// The vehicle moves at 9 m/s and turns a corner: frames 120 on are half way.
constexpr std::size_t kFirst = 120, kLast = 135;
constexpr bool kCalibrationHeld =
    false;  // what the odometry alone makes of it; else the rig would be calibrated as it is now

/// Requirements for every condition: no `ok` while it lasts, none that is wrong at any time, and
/// `ok` again at the end.
struct Verdict {
  Replay replayed;
  std::size_t first, last;

  Verdict(const Edit& edit, std::size_t from, std::size_t to, bool online = true)
      : replayed(replay(brief_drive(), edit, 1, online)), first(from), last(to) {
    EXPECT_EQ(count_ok(replayed.answers, first, last), 0) << story(replayed.answers);
    EXPECT_EQ(wrong_ok(replayed.answers, {}), "") << story(replayed.answers);
    EXPECT_EQ(replayed.allocations, 0U);
  }
  /// `ok` before the condition, and again from `settled` frames after it to the end.
  void expect_recovery(std::size_t settled) const {
    const std::size_t n = brief_drive().size();
    const auto before = std::count_if(replayed.answers.begin(), replayed.answers.end(),
                                      [this](const Answer& a) { return a.sample.frame < first; });
    EXPECT_EQ(count_ok(replayed.answers, 0, first), static_cast<int>(before))
        << story(replayed.answers);
    EXPECT_EQ(count_ok(replayed.answers, last + settled, n), static_cast<int>(n - last - settled))
        << story(replayed.answers);
  }
  void expect_status(PoseStatus status) const {
    for (const Answer& a : replayed.answers)
      if (a.sample.frame >= first && a.sample.frame < last) {
        EXPECT_EQ(a.sample.status, status) << story(replayed.answers);
      }
  }
  void expect_reason(Reason reason) const {
    for (const Answer& a : replayed.answers)
      if (a.sample.frame >= first && a.sample.frame < last) {
        EXPECT_EQ(a.sample.reason, reason) << "frame " << a.sample.frame << '\n'
                                           << story(replayed.answers);
      }
  }
  [[nodiscard]] const Answer* at(std::size_t frame) const {
    const auto found = std::find_if(replayed.answers.begin(), replayed.answers.end(),
                                    [&](const Answer& a) { return a.sample.frame == frame; });
    return found == replayed.answers.end() ? nullptr : &*found;
  }
};

constexpr std::size_t kAfterRestart =
    20;  // frames: three tries, ten marked ones after the restart, and as many to fill the map

const StereoDrive& drive() { return brief_drive(); }

TEST(OdometryInBadConditions, allBlackFramesAreLostAndTheWayGoesOnAfterThem) {
  for (const auto& [from, to, settled] : {std::tuple{kFirst, kLast, kAfterRestart},
                                          {std::size_t{0}, std::size_t{10}, std::size_t{0}}}) {
    const Verdict v(cover(drive(), Cover::both, from, to), from, to);
    v.expect_status(PoseStatus::lost);
    v.expect_reason(Reason::image_no_contrast);
    v.expect_recovery(settled);
  }
}

TEST(OdometryInBadConditions, aCameraCoveredForGoodIsNeverOkAgain) {
  for (const Cover side : {Cover::left, Cover::right}) {
    const Verdict v(cover(drive(), side, 20, drive().size()), 20, drive().size());
    EXPECT_EQ(count_ok(v.replayed.answers, 0, 20), 20);
    EXPECT_EQ(v.replayed.answers.back().sample.reason, Reason::image_no_contrast);
  }
}

TEST(OdometryInBadConditions, aMissingImageIsDegradedAndTwoAreLost) {
  for (const int camera : {0, 1}) {
    const Verdict v(take_away(camera, kFirst, kLast), kFirst, kLast);
    v.expect_status(PoseStatus::degraded);
    v.expect_reason(Reason::no_image);
    v.expect_recovery(kAfterRestart);
  }
  const Verdict both(
      [](std::size_t i, RigFrame* f) {
        if (i >= kFirst && i < kLast) f->images[0] = f->images[1] = {};
        return true;
      },
      kFirst, kLast);
  both.expect_status(PoseStatus::lost);
  both.expect_reason(Reason::no_image);
  both.expect_recovery(kAfterRestart);
}

/// The map is tracked by one camera while the rig sees it: at 9 m/s a second or two, 40 frames.
TEST(OdometryInBadConditions, aCameraThatIsAwayForLongLeavesPosesLostUntilItIsBack) {
  constexpr std::size_t kMapHasPassed = kFirst + 40, kBack = kFirst + 60;
  for (const int camera : {0, 1}) {
    const Verdict v(take_away(camera, kFirst, kBack), kFirst, kBack);
    v.expect_reason(Reason::no_image);
    EXPECT_EQ(v.at(kFirst)->sample.status, PoseStatus::degraded);
    for (std::size_t i = kMapHasPassed; i < kBack; ++i)
      EXPECT_EQ(v.at(i)->sample.status, PoseStatus::lost) << i << '\n' << story(v.replayed.answers);
    EXPECT_EQ(v.at(kBack)->sample.reason, Reason::map_reset);
    EXPECT_EQ(v.replayed.answers.back().sample.status, PoseStatus::ok);
  }
}

TEST(OdometryInBadConditions, aGlaredPairIsLost) {
  const auto white =
      std::make_shared<OwnedImage>(drive().pairs[0][0].width, drive().pairs[0][0].height);
  std::fill(white->bytes.begin(), white->bytes.end(), std::uint8_t{255});
  const Verdict v(
      [=](std::size_t i, RigFrame* f) {
        if (i >= kFirst && i < kLast) f->images[0] = f->images[1] = white->view();
        return true;
      },
      kFirst, kLast);
  v.expect_status(PoseStatus::lost);
  v.expect_recovery(kAfterRestart);
}

TEST(OdometryInBadConditions, camerasExchangedFromTheStartNeverGiveAPose) {
  const Verdict v(swap_cameras(0, drive().size()), 0, drive().size(), kCalibrationHeld);
  v.expect_status(PoseStatus::lost);
  const auto said =
      std::count_if(v.replayed.answers.begin(), v.replayed.answers.end(),
                    [](const Answer& a) { return a.sample.reason == Reason::cameras_swapped; });
  EXPECT_GT(said, 0) << "somewhere on the way there is enough near the rig to know it";
}

TEST(OdometryInBadConditions, camerasExchangedOnTheWayAreNeverOk) {
  const Verdict for_good(swap_cameras(kFirst, drive().size()), kFirst, drive().size(),
                         kCalibrationHeld);
  EXPECT_EQ(for_good.replayed.answers.back().sample.status, PoseStatus::lost);
  const Verdict for_a_while(swap_cameras(kFirst, kLast), kFirst, kLast, kCalibrationHeld);
  for_a_while.expect_recovery(kAfterRestart);
}

TEST(OdometryInBadConditions, afterTwoSecondsWithoutFramesItSaysSoAndStartsAnew) {
  const std::size_t back = kFirst + 40;
  const Verdict v(leave_out(kFirst, back), back, back + 3);
  ASSERT_NE(v.at(back), nullptr);
  EXPECT_EQ(v.at(back)->sample.reason, Reason::time_gap);
  v.expect_recovery(kAfterRestart);
  // Where a scene is rebuilt, it stands where constant velocity leads to: the step before the
  // gap, as many times as it would have been made.
  const auto restart = std::find_if(v.replayed.answers.begin(), v.replayed.answers.end(),
                                    [](const Answer& a) { return a.restarted; });
  if (restart == v.replayed.answers.end()) return;
  EXPECT_EQ(restart->sample.status, PoseStatus::degraded);
  EXPECT_EQ(restart->sample.reason, Reason::map_reset);
  const Transform& last = v.at(kFirst - 1)->sample.T_world_left;
  const Vec3 step = last.t - v.at(kFirst - 2)->sample.T_world_left.t;
  const double frames = std::min<double>(static_cast<double>(restart->sample.frame - (kFirst - 1)),
                                         40);  // no further than two seconds
  // The way bends with the rig's turn: a path of that length ends within it, and ahead.
  const Vec3 way = restart->sample.T_world_left.t - last.t;
  EXPECT_LT(way.norm(), 1.01 * frames * step.norm());
  EXPECT_GT(way.norm(), 0.5 * frames * step.norm());
}

TEST(OdometryInBadConditions, aFrameThatComesAgainIsDegraded) {
  const Verdict v(
      [](std::size_t i, RigFrame* f) {
        if (i >= kFirst && i < kFirst + 3)
          for (std::size_t k = 0; k < 2; ++k) f->images[k] = drive().pairs[kFirst - 1][k].view();
        return true;
      },
      kFirst, kFirst + 3);
  v.expect_status(PoseStatus::degraded);
  v.expect_reason(Reason::image_repeated);
  v.expect_recovery(0);
}

}  // namespace
}  // namespace vergence::test
