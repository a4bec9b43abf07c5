#include <gtest/gtest.h>

#include "app/runtime/background_thread.hpp"

namespace vergence::app {
namespace {

/// A solver that is as busy as it is told to be.
struct ManualSolver final : BackgroundRunner {
  bool is_busy = false;
  int waits = 0;
  void start(TaskRef task) noexcept override { task(); }
  [[nodiscard]] bool busy() noexcept override { return is_busy; }
  void wait() noexcept override {
    ++waits;
    is_busy = false;
  }
};

TEST(ReplayableSolverRunner, recordsFramesWithIdleSolver) {
  ManualSolver solver;
  ReplayableSolverRunner watch(solver);
  watch.begin_frame(std::nullopt);
  EXPECT_FALSE(watch.found_idle()) << "nobody asked";
  solver.is_busy = true;
  EXPECT_TRUE(watch.busy());
  EXPECT_FALSE(watch.found_idle());
  solver.is_busy = false;
  EXPECT_FALSE(watch.busy());
  EXPECT_TRUE(watch.found_idle());
  watch.begin_frame(std::nullopt);
  EXPECT_FALSE(watch.found_idle());
  EXPECT_EQ(solver.waits, 0);
}

TEST(ReplayableSolverRunner, replaysRecordedAnswers) {
  ManualSolver solver;
  ReplayableSolverRunner watch(solver);
  watch.begin_frame(false);
  EXPECT_TRUE(watch.busy()) << "the solver is faster now";
  EXPECT_FALSE(watch.found_idle());
  solver.is_busy = true;
  watch.begin_frame(true);
  EXPECT_FALSE(watch.busy()) << "the solver is slower now: it is waited for";
  EXPECT_EQ(solver.waits, 1);
  EXPECT_TRUE(watch.found_idle()) << "a recording of the replay says the same";
}

}  // namespace
}  // namespace vergence::app
