#include "app/session/temperature_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/session/waiting_source.hpp"

namespace vergence::app {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

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
