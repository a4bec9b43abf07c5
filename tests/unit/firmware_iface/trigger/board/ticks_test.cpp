// The board's microseconds: by the crystal, by PPS, and after PPS is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "tests/unit/firmware_iface/trigger/board/virtual_board.hpp"

namespace vergence {
namespace {

constexpr double kHz = VirtualBoard::kHz;

/// PPS on a crystal that is off by `ppm`, with a receiver's jitter of ±`jitter_us`; true second k
/// is at count(k).
struct Pps {
  double ppm = 0, jitter_us = 0;
  std::uint32_t random = 1;
  [[nodiscard]] std::uint64_t count(double second) const {
    return 1'000'000 + static_cast<std::uint64_t>(std::llround(second * kHz * (1 + ppm * 1e-6)));
  }
  std::uint64_t edge(std::uint64_t second) {
    random = random * 1664525U + 1013904223U;
    const double unit = static_cast<double>(random >> 8U) / (1 << 23) - 1;
    return count(static_cast<double>(second) + unit * jitter_us * 1e-6);
  }
};

/// A board whose host has said HELLO or not, with PPS from second `from` up to `to` (excluded).
struct Disciplined : testing::Test {
  VirtualBoard b;
  Pps pps;
  void begin(bool hello) {
    if (hello) b.send(trigger_hello, {trigger_protocol_version});
    TriggerConfig c = VirtualBoard::config(30'000);
    c.pps_edge = trigger_edge_rising;
    b.configure(c);
  }
  void feed(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t k = from; k < to; ++k) {
      const std::uint64_t at = pps.edge(k);
      b.edge_at(at, board_input_pps, true);
      b.edge_at(at + 8'400'000, board_input_pps, false);
    }
    b.run_until(pps.count(static_cast<double>(to) - 0.5));
  }
  /// Tick at a true second, less that second.
  [[nodiscard]] double error_us(double second) const {
    return static_cast<double>(board_tick(&b.board, pps.count(second))) - second * 1e6;
  }
};

TEST(BoardTicks, ticksFollowTheCrystalWithoutPps) {
  VirtualBoard b;
  for (const std::uint64_t s : {1ULL, 60ULL, 86'400ULL, 100'000ULL}) {
    b.run_until(1'000'000 + s * VirtualBoard::kHz);
    const auto off =
        static_cast<double>(board_tick(&b.board, b.now)) - static_cast<double>(s) * 1e6;
    EXPECT_LE(std::abs(off), 0.5 + static_cast<double>(s) * 4e-5)
        << "the rate is held to 2^-41 us a count";
  }
}

TEST_F(Disciplined, rateIsTakenAtOnceBeforeHello) {
  pps.ppm = 50;
  begin(false);
  feed(1, 7);
  EXPECT_EQ(b.status().pps_locked, 1);
  const double at_lock = error_us(6.2);
  EXPECT_LT(std::abs(error_us(6.4) - at_lock), 2);
  feed(7, 100);
  EXPECT_LT(std::abs(error_us(99.4) - at_lock), 2)
      << "a tick is a second of PPS, whatever the crystal";
}

struct DisciplinedSlowly : Disciplined, testing::WithParamInterface<double> {};
INSTANTIATE_TEST_SUITE_P(BothWays, DisciplinedSlowly, testing::Values(50.0, -50.0));

TEST_P(DisciplinedSlowly, afterHelloRateIsSteeredInSmallSteps) {
  pps.ppm = GetParam();
  begin(true);
  auto rate_before = static_cast<double>(b.board.ticks.segment.rate);
  std::uint64_t locked_at = 0;
  for (std::uint64_t k = 1; k < 120; ++k) {
    feed(k, k + 1);
    const auto rate = static_cast<double>(b.board.ticks.segment.rate);
    const double missing_ppm =
        (rate_before / static_cast<double>(b.board.ticks.estimate) - 1) * 1e6;
    const double step_ppm = (rate / rate_before - 1) * 1e6;
    ASSERT_LE(std::abs(step_ppm), std::max(1.001, std::abs(missing_ppm) / 16 + 0.001))
        << "second " << k;
    rate_before = rate;
    if (locked_at == 0 && b.status().pps_locked == 1) locked_at = k;
  }
  EXPECT_GT(locked_at, 10U);
  EXPECT_LT(locked_at, 60U);
  const double kept = error_us(119.1);
  feed(120, 400);
  EXPECT_LT(std::abs(error_us(399.4) - kept), 2);
}

TEST_F(Disciplined, ticksAreMonotonicAndSmooth) {
  pps.ppm = -73;
  pps.jitter_us = 30;
  begin(true);
  std::uint64_t count = b.now, tick = board_tick(&b.board, count);
  for (std::uint64_t k = 1; k < 200; ++k) {
    // PPS has outages of ten seconds.
    if (k % 50 < 40) feed(k, k + 1);
    const std::uint64_t until = pps.count(static_cast<double>(k) + 0.5);
    while (count < until) {
      // The step is 10 ms.
      count += 840'000;
      const std::uint64_t now_tick = board_tick(&b.board, count);
      const auto step = static_cast<double>(now_tick - tick);
      ASSERT_GE(now_tick, tick);
      // The tolerance is 100 ppm of 10 ms and two roundings.
      ASSERT_NEAR(step, 10'000, 3) << "second " << k;
      tick = now_tick;
    }
    b.run_until(until);
  }
}

TEST_F(Disciplined, receiverJitterIsAveraged) {
  pps.ppm = 20;
  pps.jitter_us = 0.5;
  begin(false);
  feed(1, 60);
  const double at = error_us(59.2);
  double worst = 0;
  for (std::uint64_t k = 60; k < 600; ++k) {
    feed(k, k + 1);
    worst = std::max(worst, std::abs(error_us(static_cast<double>(k) + 0.4) - at));
  }
  EXPECT_LT(worst, 3);
}

TEST_F(Disciplined, rateIsKeptAfterPpsIsLost) {
  pps.ppm = 50;
  begin(false);
  feed(1, 60);
  const double before = error_us(59.4);
  b.run_until(pps.count(65));
  EXPECT_EQ(b.status().pps_locked, 0) << "reported within five seconds";
  b.run_until(pps.count(659));
  const double after = error_us(659);
  EXPECT_LT(std::abs(after - before), 600 * 0.02 + 2) << "0.02 ppm: a count in a second";
  EXPECT_GE(b.status().pps_age_ms, 598'000U);
  feed(660, 700);
  EXPECT_EQ(b.status().pps_locked, 1);
}

TEST_F(Disciplined, spuriousEdgesAreReportedButNotFollowed) {
  pps.ppm = 10;
  begin(false);
  feed(1, 30);
  const double before = error_us(29.4);
  // Every third second has a spike between two edges.
  for (std::uint64_t k = 30; k < 60; ++k)
    if (k % 3 == 0) b.edge_at(pps.count(static_cast<double>(k) + 0.3), board_input_pps, true);
  b.frames.clear();
  feed(30, 60);
  std::size_t reported = 0;
  for (const TriggerFrame& f : b.frames) reported += f.type == trigger_pps ? 1U : 0U;
  EXPECT_EQ(reported, 40U);
  EXPECT_EQ(b.status().pps_locked, 1);
  EXPECT_LT(std::abs(error_us(59.4) - before), 2);
}

TEST_F(Disciplined, edgesOffBy400usAreNotFollowed) {
  pps.ppm = 10;
  begin(false);
  feed(1, 30);
  const double before = error_us(29.4);
  for (std::uint64_t k = 30; k < 90; ++k) {
    if (k % 7 == 0)
      b.edge_at(pps.count(static_cast<double>(k) + 400e-6), board_input_pps, true);
    else
      feed(k, k + 1);
  }
  EXPECT_EQ(b.status().pps_locked, 1);
  EXPECT_LT(std::abs(error_us(89.4) - before), 2);
}

TEST_F(Disciplined, movedPhaseIsSteeredUntilPpsIsLost) {
  pps.ppm = 30;
  begin(false);
  feed(1, 30);
  b.send(trigger_hello, {trigger_protocol_version});
  feed(30, 32);
  const double before = error_us(31.4);
  // The receiver shifts its pulse by this time.
  constexpr double kMoved = 60e-6;
  const auto feed_moved = [this](int from, int to) {
    for (int k = from; k < to; ++k) b.edge_at(pps.count(k + kMoved), board_input_pps, true);
    b.run_until(pps.count(to - 0.5));
  };
  feed_moved(32, 300);
  EXPECT_LT(std::abs(error_us(299.4) - before + kMoved * 1e6), 2)
      << "whole seconds at the moved edges";
  // Back again, for 20 s: the slope sees it no more, the phase is still being steered, and then PPS
  // is lost.
  feed(300, 320);
  EXPECT_GT(std::abs(static_cast<double>(b.board.ticks.segment.rate) /
                         static_cast<double>(b.board.ticks.estimate) -
                     1),
            0.1e-6);
  b.run_until(pps.count(326));
  EXPECT_EQ(b.status().pps_locked, 0);
  EXPECT_EQ(b.board.ticks.segment.rate, b.board.ticks.estimate) << "nothing steers any more";
  const double lost = error_us(326);
  feed(400, 500);
  EXPECT_EQ(b.status().pps_locked, 1);
  EXPECT_LT(std::abs(error_us(499.4) - before), 2);
  EXPECT_LT(std::abs(lost - before), 60);
}

TEST(BoardTicks, rateChangeKeepsTicksOfEarlierStamps) {
  TickDiscipline d{};
  tick_init(&d, 84'000'000, 200, 0);
  // The crystal is off by 150 ppm.
  const std::uint64_t second = 84'000'000 + 12'600;
  for (std::uint64_t k = 1; k < 4; ++k) EXPECT_TRUE(tick_pps(&d, k * second, k * second + 100));
  // The edge is reported half a second later.
  const std::uint64_t edge = 4 * second, reported = edge + 42'000'000;
  const std::uint64_t between = edge + 40'000'000;
  const std::uint64_t tick = tick_of(&d, between), at_told = tick_of(&d, reported);
  EXPECT_TRUE(tick_pps(&d, edge, reported));
  EXPECT_TRUE(d.locked);
  EXPECT_EQ(tick_of(&d, between), tick);
  EXPECT_EQ(tick_of(&d, reported), at_told);
  EXPECT_EQ(tick_of(&d, reported + second) - at_told, 1'000'000U);
}

TEST_F(Disciplined, signalOfWrongPeriodNeverLocks) {
  begin(false);
  for (int k = 1; k < 40;
       // Each second is within the crystal's 200 ppm, but successive seconds disagree.
       ++k)
    b.edge_at(b.now + static_cast<std::uint64_t>((k + (k % 2) * 150e-6) * kHz), board_input_pps,
              true);
  b.run_until(b.now + static_cast<std::uint64_t>(40 * kHz));
  EXPECT_EQ(b.status().pps_locked, 0);
  b.run_for_us(20'000'000);
  for (const double period : {0.02, 0.9, 1.001, 0.999}) {
    for (int k = 0; k < 20; ++k)
      b.edge_at(b.now + static_cast<std::uint64_t>((k + 1) * period * kHz), board_input_pps, true);
    b.run_until(b.now + static_cast<std::uint64_t>(21 * period * kHz));
    EXPECT_EQ(b.status().pps_locked, 0) << period;
    b.run_for_us(20'000'000);
  }
  EXPECT_EQ(board_tick(&b.board, b.now), (b.now - 1'000'000 + 42) / 84) << "the crystal's ticks";
}

TEST_F(Disciplined, newPhaseLocksWithinSevenSeconds) {
  pps.ppm = 5;
  begin(false);
  feed(1, 30);
  // The pulses are another receiver's.
  for (int k = 31; k < 90; ++k) b.edge_at(pps.count(k + 0.37), board_input_pps, true);
  b.run_until(pps.count(33.9));
  EXPECT_EQ(b.status().pps_locked, 0) << "three in a row did not fit";
  b.run_until(pps.count(36.9));
  EXPECT_EQ(b.status().pps_locked, 1);
  b.run_until(pps.count(90));
  EXPECT_EQ(b.status().pps_locked, 1);
}

}  // namespace
}  // namespace vergence
