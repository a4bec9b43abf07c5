#include "app/runtime/signals.hpp"

#include <gtest/gtest.h>

namespace vergence::app {
namespace {

TEST(SignalGuard, restoresThePreviousHandler) {
  static int calls = 0;
  calls = 0;
  auto* const before = std::signal(SIGINT, [](int) { ++calls; });
  { const SignalGuard guard; }
  std::raise(SIGINT);
  EXPECT_EQ(calls, 1);
  std::signal(SIGINT, before);
}

TEST(SignalGuard, sigusr1RequestsACalibration) {
  const SignalGuard guard;
  EXPECT_FALSE(guard.poll_calibration_request());
  for (int i = 0; i < 3; ++i) {
    std::raise(SIGUSR1);
    EXPECT_TRUE(guard.poll_calibration_request());
    EXPECT_FALSE(guard.poll_calibration_request());
  }
  EXPECT_FALSE(guard.stop_requested());
}

TEST(SignalGuard, hangupStopsUnlessIgnored) {
  {
    const SignalGuard guard;
    std::raise(SIGHUP);
    EXPECT_EQ(guard.stop_code(), ExitCode::terminated);
  }
  auto* const before = std::signal(SIGHUP, SIG_IGN);
  {
    const SignalGuard guard;
    std::raise(SIGHUP);
    EXPECT_FALSE(guard.stop_requested());
  }
  std::signal(SIGHUP, before);
}

TEST(SignalGuard, brokenPipeAndFileLimitAreIgnored) {
  const SignalGuard guard;
  for (const int number : {SIGPIPE, SIGXFSZ, SIGUSR2}) std::raise(number);
  EXPECT_FALSE(guard.stop_requested());
}

TEST(SignalGuardDeathTest, secondSignalEndsTheProgram) {
  EXPECT_EXIT(
      {
        const SignalGuard guard;
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

}  // namespace
}  // namespace vergence::app
