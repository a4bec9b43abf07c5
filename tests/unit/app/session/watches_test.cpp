#include <gtest/gtest.h>

#include <string>

#include "app/session/solver_watch.hpp"
#include "app/session/timing_monitor.hpp"

namespace vergence::app {
namespace {

/// A solver that is as busy as it is told to be.
struct ToldSolver final : BackgroundRunner {
  bool is_busy = false;
  int waits = 0;
  void start(TaskRef task) noexcept override { task(); }
  [[nodiscard]] bool busy() noexcept override { return is_busy; }
  void wait() noexcept override {
    ++waits;
    is_busy = false;
  }
};

TEST(SolverWatch, notesTheFramesAtWhichTheSolverIsFoundIdle) {
  ToldSolver solver;
  SolverWatch watch(solver);
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

TEST(SolverWatch, answersInAReplayAsInTheDrive) {
  ToldSolver solver;
  SolverWatch watch(solver);
  watch.begin_frame(false);
  EXPECT_TRUE(watch.busy()) << "the solver is faster now";
  EXPECT_FALSE(watch.found_idle());
  solver.is_busy = true;
  watch.begin_frame(true);
  EXPECT_FALSE(watch.busy()) << "the solver is slower now: it is waited for";
  EXPECT_EQ(solver.waits, 1);
  EXPECT_TRUE(watch.found_idle()) << "a recording of the replay says the same";
}

AcquiredReading reading(std::int64_t stamp_ns, std::int64_t utc_ns) {
  AcquiredReading r;
  r.sample.stamp = Stamp(stamp_ns);
  r.quality.utc_valid = true;
  r.quality.utc_ns = utc_ns;
  return r;
}

TEST(TimingMonitor, saysHowFarTheStampsAreFromUtcAndAgainOnceThatHasChanged) {
  TimingMonitor monitor(SyncMode::board, false);
  constexpr std::int64_t kUtc = 1'700'000'000'000'000'000, kMs = 1'000'000;
  (void)monitor.of_reading(reading(kUtc, kUtc));  // tells of the fix
  const auto told = monitor.of_reading(reading(kUtc - 250 * kMs, kUtc));
  ASSERT_NE(told.kind, nullptr);
  EXPECT_STREQ(told.kind, "utc");
  const std::string text = told.text.data();
  EXPECT_NE(text.find("the session's stamps are 0.2500 s behind the INS's UTC"), std::string::npos)
      << text << ": the host's clock may have been set since the start";
  EXPECT_EQ(monitor.of_reading(reading(kUtc - 200 * kMs, kUtc)).kind, nullptr);
  const auto set = monitor.of_reading(reading(kUtc + 3000 * kMs, kUtc));
  ASSERT_NE(set.kind, nullptr);
  EXPECT_NE(std::string(set.text.data()).find("3.0000 s ahead of"), std::string::npos);
}

}  // namespace
}  // namespace vergence::app
