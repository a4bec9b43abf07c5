#include "app/session/heartbeat.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>

#include "app/session/solver_watch.hpp"
#include "app/session/temperature_watch.hpp"
#include "app/session/timing_monitor.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/session/waiting_source.hpp"

namespace vergence::app {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Whether the next look finds another number.
bool beats(Heartbeat* heart, std::uint64_t items, bool waiting, std::uint64_t rounds) {
  const std::uint64_t before = heart->beats(items, false, rounds - 1);
  return heart->beats(items, waiting, rounds) != before;
}

TEST(Heartbeat, aLoopThatWaitsIsAliveWhileTheDevicesThreadGoesRound) {
  Heartbeat heart;
  std::uint64_t last = heart.beats(7, true, 1);
  for (std::uint64_t round = 2; round < 100; ++round) {
    const std::uint64_t now = heart.beats(7, true, round);
    EXPECT_NE(now, last) << round;
    last = now;
  }
}

TEST(Heartbeat, whereADeviceHoldsUpThatThreadItIsNot) {
  Heartbeat heart;
  const std::uint64_t last = heart.beats(7, true, 5);
  for (int look = 0; look < 100; ++look) EXPECT_EQ(heart.beats(7, true, 5), last);
  EXPECT_NE(heart.beats(7, true, 6), last) << "it was slow";
}

TEST(Heartbeat, anEstimatorThatHangsIsNotAliveWhateverTheDevicesDo) {
  Heartbeat heart;
  EXPECT_FALSE(beats(&heart, 7, false, 10));
  EXPECT_TRUE(beats(&heart, 7, true, 20));
  EXPECT_FALSE(beats(&heart, 7, false, 30)) << "it works on what it was given";
}

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

/// Camera 0 tells at once, camera 1 takes a second and a half, as one whose cable was pulled.
class SlowCamera final : public test::WaitingSource {
 public:
  explicit SlowCamera(Milliseconds drive) : WaitingSource(drive) {}
  [[nodiscard]] std::optional<double> temperature_c(int camera) override {
    asked_ = asked_ + 1;
    if (camera == 1) std::this_thread::sleep_for(1500ms);
    if (camera == 1) answered_ = Clock::now();
    return 20.0 + camera;
  }
  void look() override {
    const auto now = Clock::now();
    if (looked_ != Clock::time_point{}) longest_ = std::max(longest_, now - looked_);
    looked_ = now;
  }
  void halt() noexcept override { halted_ = Clock::now(); }

  std::atomic<int> asked_{0};
  Clock::time_point looked_{}, halted_{}, answered_{};
  Clock::duration longest_{};  // between two looks
};

class Thermometer final : public SessionObserver {
 public:
  explicit Thermometer(bool wants) : wants_(wants) {}
  [[nodiscard]] bool wants_temperatures() const noexcept override { return wants_; }
  void on_temperature(int camera, double celsius) noexcept override {
    told_ += camera == 0 && celsius == 20.0 ? 1 : 0;
  }
  int told_ = 0;

 private:
  const bool wants_;
};

void drive(SlowCamera* source, Thermometer* observer) {
  const test::TemporaryFolder folder;
  SessionOptions options;
  options.out = folder / "session";
  options.quiet = true;
  options.observers = {observer};
  const SignalGuard signals;
  testing::internal::CaptureStderr();
  (void)run_session(*source, load_configuration(std::nullopt, {}), options, signals);
  (void)testing::internal::GetCapturedStderr();
}

TEST(SessionTemperatures, aCameraThatTakesSecondsToAnswerHoldsUpNeitherTheWatchNorTheEnd) {
  SlowCamera source(700ms);
  Thermometer observer(true);
  drive(&source, &observer);
  EXPECT_EQ(observer.told_, 1);
  EXPECT_LT(source.longest_, 1s) << "the watchdog and SIGTERM wait for that thread";
  EXPECT_LT(source.halted_, source.answered_) << "cameras are stopped while one is still asked";
}

TEST(TemperatureWatch, givesEachAnswerOnceAndAsksNoCameraAfterItsEnd) {
  SlowCamera source(0ms);
  TemperatureWatch watch(source);
  watch.begin();
  TemperatureWatch::Celsius celsius;
  for (int i = 0; i < 1000 && !celsius[0]; ++i) {
    std::this_thread::sleep_for(1ms);
    celsius = watch.take_new();
  }
  EXPECT_EQ(celsius[0], 20.0);
  EXPECT_FALSE(watch.take_new()[0]);
  const auto begun = Clock::now();
  watch.end();
  EXPECT_LT(Clock::now() - begun, 1s) << "it waits for nobody";
  while (!watch.take_new()[1]) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(source.asked_, 2);
}

}  // namespace
}  // namespace vergence::app
