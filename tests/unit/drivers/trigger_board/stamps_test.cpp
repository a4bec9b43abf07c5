#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

using test::board_for;
using test::BoardRig;
using test::direct_line;
using test::thirty_hertz;

struct Errors {
  double rms_us = 0, p99_us = 0, worst_us = 0, bound_us = 0;
  std::size_t beyond_bound = 0, count = 0;
};

/// |mapped − true| of the edges later than `settled` after the first, over seeds whose crystals are
/// off by ±50 ppm.
Errors errors_of(mock::BoardSimulatorOptions board, mock::SimulatedLineOptions line,
                 Duration settled, const Options& options = {}) {
  std::vector<double> us;
  Errors e;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    board.seed = line.seed = seed;
    board.clock_ppm = seed % 2 == 0 ? 50 : -50;
    board.duration = Duration::seconds(60);
    BoardRig rig(board, line, options);
    // As a camera does: the report comes at the end of its exposure.
    rig.exposures = [](const mock::SimulatedPulse& p) {
      mock::SimulatedExposures x;
      x[0] =
          x[1] = {true, p.edge + Duration::microseconds(30), p.edge + Duration::microseconds(8030)};
      return x;
    };
    TriggerConfiguration requested = thirty_hertz();
    requested.feedback = 0x03;
    EXPECT_EQ(rig.device->configure(requested, nullptr), DeviceStatus::ok)
        << rig.device->last_error();
    EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
    const auto all = rig.pulses();
    EXPECT_GT(all.size(), 1700U);
    for (const Pulse& p : all) {
      const double error = std::abs((p.host - rig.truth(p)).to_seconds()) * 1e6,
                   bound = p.host_error.to_seconds() * 1e6;
      if (error > bound) ++e.beyond_bound;
      if (p.edge - all.front().edge < settled) continue;
      us.push_back(error);
      e.rms_us += error * error;
      e.bound_us = std::max(e.bound_us, bound);
    }
  }
  std::sort(us.begin(), us.end());
  e.count = us.size();
  e.rms_us = std::sqrt(e.rms_us / static_cast<double>(us.size()));
  e.p99_us = us[us.size() * 99 / 100];
  e.worst_us = us.back();
  return e;
}

void print(const char* what, const Errors& e) {
  std::printf(
      "[ figures  ] %s: rms %.1f us, p99 %.1f us, worst %.1f us, largest bound %.0f us, %zu of %zu "
      "beyond their bound\n",
      what, e.rms_us, e.p99_us, e.worst_us, e.bound_us, e.beyond_bound, e.count);
}

TEST(Stamps, areRightWithinFiftyMicrosecondsOverALineWithTwoMillisecondsOfJitter) {
  mock::SimulatedLineOptions line = direct_line();
  line.fifo = 64;
  line.late_fraction = line.sent_late_fraction = 1;
  line.late_mean = line.sent_late_mean = Duration::milliseconds(2);
  const Errors e = errors_of(board_for({}), line, Duration::seconds(10));
  print("2 ms of jitter each way, after 10 s", e);
  EXPECT_LE(e.rms_us, 20);
  EXPECT_LE(e.p99_us, 50);
  EXPECT_EQ(e.beyond_bound, 0U);
}

TEST(Stamps, followACrystalThatWarmsUp) {
  mock::SimulatedLineOptions line = direct_line();
  line.fifo = 64;
  line.late_fraction = line.sent_late_fraction = 1;
  line.late_mean = line.sent_late_mean = Duration::milliseconds(2);
  mock::BoardSimulatorOptions board = board_for({});
  board.wander_ppm = 2;
  board.wander_period = Duration::seconds(240);  // as fast as 0.05 ppm a second
  const Errors e = errors_of(board, line, Duration::seconds(10));
  print("the same with a crystal that wanders", e);
  EXPECT_LE(e.rms_us, 20);
  EXPECT_LE(e.p99_us, 50);
  EXPECT_EQ(e.beyond_bound, 0U);
}

TEST(Stamps, followTicksThatPpsIsTakingToItsOwnRate) {
  mock::SimulatedLineOptions line = direct_line();
  line.fifo = 64;
  line.late_fraction = line.sent_late_fraction = 1;
  line.late_mean = line.sent_late_mean = Duration::milliseconds(2);
  mock::BoardSimulatorOptions board = board_for({});
  board.pps = true;
  const Errors e = errors_of(board, line, Duration::seconds(10), {.pps = Edge::rising});
  print("the same with PPS that moves the rate by 50 ppm", e);
  EXPECT_LE(e.rms_us, 20);
  EXPECT_LE(e.p99_us, 50);
  EXPECT_EQ(e.beyond_bound, 0U);
}

TEST(Stamps, areRightWithinTensOfMicrosecondsOverAQuietLine) {
  const Errors e = errors_of(board_for({}), direct_line(), Duration::seconds(10));
  print("a quiet line, after 10 s", e);
  EXPECT_LE(e.p99_us, 50);
  EXPECT_EQ(e.beyond_bound, 0U);
}

/// A USB converter holds bytes back for its latency timer. With 16 ms this line's bytes fill its
/// packets before the timer runs out, and the last of a full packet leave at once; with 1 ms every
/// packet waits for a frame of the bus, 1 ms, and half of that is in the stamps, where nothing on
/// the host can see it. It is within the bound.
class Converter : public ::testing::TestWithParam<int> {};
TEST_P(Converter, isWithinItsBound) {
  mock::SimulatedLineOptions line;
  line.latency_timer = Duration::milliseconds(GetParam());
  const Errors e = errors_of(board_for({}), line, Duration::seconds(10));
  print(("a converter with a latency timer of " + std::to_string(GetParam()) + " ms").c_str(), e);
  EXPECT_LE(e.p99_us, GetParam() == 1 ? 1000 : 300);
  EXPECT_EQ(e.beyond_bound, 0U);
}
INSTANTIATE_TEST_SUITE_P(Stamps, Converter, ::testing::Values(1, 16));

}  // namespace
}  // namespace vergence::trigger_board
