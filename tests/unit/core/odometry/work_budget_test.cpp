#include "core/odometry/work_budget.hpp"

#include <gtest/gtest.h>

namespace vergence::odometry {
namespace {

constexpr int kKeyframes = 10, kSteps = 5;
// s: what the clock passes within a test is nothing beside it.
// kStep is the time of one step of one keyframe, so the window takes 2000 s.
constexpr double kPoints = 1000, kStep = 40;

/// Plan of a frame that has `usable_s` seconds from now, with the costs above known.
FrameWorkload effort_in(double usable_s) {
  WorkBudget budget;
  budget.add_points_time(1e3 * kPoints, {});
  budget.add_window_time(1e3 * kStep * kKeyframes * kSteps, kKeyframes, kSteps);
  budget.begin(Duration::seconds(usable_s / 0.9));
  return budget.plan(kKeyframes, kSteps);
}

TEST(WorkBudget, zeroBudgetMeansNoLimit) {
  WorkBudget budget;
  budget.add_points_time(1e9, {});
  budget.begin({});
  EXPECT_TRUE(budget.plan(kKeyframes, kSteps).whole());
}

TEST(WorkBudget, pointsThenWindowThenSolverStepsAreReduced) {
  constexpr auto kAll = FrameWorkload::kAll;
  struct Row {
    double usable_s;
    int points_percent, window_keyframes, window_steps;
  };
  for (const Row& row : {
           Row{3010, 100, kAll, kAll},
           {2601, 60, kAll, kAll},
           // A quarter of the points and seven keyframes.
           {250 + 1401, 25, 7, kAll},
           // Two steps of four keyframes.
           {250 + 321, 25, 4, 2},
           {300, 25, 0, 0},
           {1, 25, 0, 0},
       }) {
    const FrameWorkload e = effort_in(row.usable_s);
    EXPECT_EQ(e.points_percent, row.points_percent) << row.usable_s;
    EXPECT_EQ(e.window_keyframes, row.window_keyframes) << row.usable_s;
    EXPECT_EQ(e.window_steps, row.window_steps) << row.usable_s;
  }
}

TEST(WorkBudget, singleCostlyFrameIsForgotten) {
  WorkBudget budget;
  budget.add_points_time(1e9, {});
  // 0.8 to the 40th is 1.3e-4.
  for (int i = 0; i < 40; ++i) budget.add_points_time(1e3, {});
  budget.begin(Duration::seconds(200));
  EXPECT_TRUE(budget.plan(kKeyframes, kSteps).whole());
}

TEST(WorkBudget, omittedWindowIsTriedAgain) {
  WorkBudget budget;
  budget.add_window_time(1e6, kKeyframes, kSteps);
  int frames = 0;
  FrameWorkload e;
  do {
    budget.begin(Duration::seconds(200));
    e = budget.plan(kKeyframes, kSteps);
    // All but a window that is left out takes next to nothing.
    const bool left_out = e.window_keyframes == 0;
    budget.add_window_time(left_out ? 0 : 1, left_out ? 0 : kKeyframes, left_out ? 0 : kSteps);
  } while (!e.whole() && ++frames < 100);
  EXPECT_GT(frames, 0);
  EXPECT_LE(frames, 11) << "0.8 to the 8th is the sixth of it that there is time for";
}

}  // namespace
}  // namespace vergence::odometry
