// When pulses are due, and which exposure belongs to which.
#include <gtest/gtest.h>

#include "tests/unit/firmware_iface/trigger/board/virtual_board.hpp"

namespace vergence {
namespace {

constexpr std::uint64_t kUs = VirtualBoard::kHz / 1'000'000;

TEST(BoardSchedule, millionPulsesAreExactToOneCount) {
  for (const std::uint32_t millihertz : {29'970U, 30'000U, 7U, 999'983U, 33'333U}) {
    PulseSchedule s{};
    schedule_set(&s, VirtualBoard::kHz, millihertz, 0);
    schedule_begin(&s, 5);
    std::uint64_t before = s.due;
    for (std::uint32_t n = 1; n <= 1'000'000; ++n) {
      schedule_advance(&s);
      ASSERT_EQ(s.due, 5 + std::uint64_t{n} * VirtualBoard::kHz * 1000 / millihertz)
          << millihertz << " mHz, pulse " << n;
      ASSERT_LE(s.due - before, s.interval + 1);
      before = s.due;
    }
    EXPECT_EQ(s.next, 1'000'000U);
  }
}

TEST(BoardSchedule, variedIntervalsFollowTheSharedBits) {
  PulseSchedule s{};
  schedule_set(&s, VirtualBoard::kHz, 30'000, 1500);
  s.next = 12'345;
  schedule_begin(&s, 0);
  for (std::uint32_t k = 12'345; k < 13'345; ++k) {
    const std::uint64_t from = s.due;
    ASSERT_EQ(s.next, k);
    schedule_advance(&s);
    ASSERT_EQ(s.due - from, (trigger_interval_is_longer(k) ? 2'926'000U : 2'674'000U));
  }
}

TEST(BoardPulses, keepGridWidthAndLines) {
  VirtualBoard b;
  TriggerConfig c = VirtualBoard::config(29'970);
  c.lines = 0x5;
  c.active_low = 0x4;
  c.dither_us = 800;
  b.configure(c);
  b.send(trigger_start);
  b.run_for_us(10'000'000);
  ASSERT_GT(b.made.size(), 290U);
  PulseSchedule expected{};
  schedule_set(&expected, VirtualBoard::kHz, 29'970, 800);
  schedule_begin(&expected, b.made[0].count);
  for (const BoardPulse& p : b.made) {
    ASSERT_EQ(p.count, expected.due);
    ASSERT_EQ(p.number, expected.next);
    ASSERT_EQ(p.width, 200 * kUs);
    ASSERT_EQ(p.lines, 0x5);
    ASSERT_EQ(p.active_low, 0x4);
    schedule_advance(&expected);
  }
  const auto events = b.events();
  ASSERT_EQ(events.size(), b.made.size());
  for (std::size_t i = 0; i < events.size(); ++i)
    ASSERT_LE(
        std::llabs(static_cast<long long>(events[i].tick * kUs - (b.made[i].count - 1'000'000))),
        kUs / 2 + 1);
}

TEST(BoardPulses, refusedPulseIsSentLateAndFlagged) {
  VirtualBoard b;
  b.start(100'000);
  ASSERT_TRUE(b.armed);
  const std::uint64_t due = b.pulse.count;
  b.armed = false;
  board_pulse_refused(&b.board);
  // The time is long past the pulse.
  b.now = due + 300 * kUs;
  b.run_for_us(30'000);
  const auto events = b.events();
  ASSERT_GE(events.size(), 3U);
  EXPECT_EQ(events[0].pulse, 0U);
  EXPECT_EQ(events[0].flags, 3) << "first, and late";
  EXPECT_EQ(b.made[0].count, due + 350 * kUs) << "as soon as can be";
  EXPECT_EQ(b.made[1].count, due + 10'000 * kUs);
  EXPECT_EQ(events[1].flags, 0);
  EXPECT_EQ(events[2].tick - events[1].tick, 10'000U) << "the others stay on the grid";
}

TEST(BoardPulses, delayedBoardSkipsNumbersToKeepTheGrid) {
  VirtualBoard b;
  b.start(100'000);
  b.run_for_us(15'000);
  const std::uint64_t armed_count = b.pulse.count;
  // Only the armed pulse went out during this second.
  b.now += 1'000'000 * kUs;
  b.armed = false;
  board_pulse_made(&b.board, b.now, armed_count, false);
  b.made.clear();
  b.listen();
  b.frames.clear();
  b.run_for_us(50'000);
  ASSERT_GE(b.made.size(), 4U);
  EXPECT_LE(b.made.size(), 6U);
  const auto events = b.events();
  EXPECT_GT(events[0].pulse, 90U);
  EXPECT_EQ(events[0].flags, 2);
  EXPECT_EQ(events[1].flags, 0);
  EXPECT_EQ((b.made[1].count - armed_count) % (10'000 * kUs), 0U);
}

TEST(BoardPulses, areArmedAtMostAQuarterSecondAhead) {
  VirtualBoard b;
  // The rate is one pulse in ten seconds.
  b.configure(VirtualBoard::config(100));
  b.send(trigger_start);
  b.run_for_us(5'000'000);
  EXPECT_EQ(b.made.size(), 1U);
  EXPECT_FALSE(b.armed);
  b.run_for_us(4'900'000);
  EXPECT_TRUE(b.armed);
  EXPECT_LE(b.pulse.count - b.now, VirtualBoard::kHz / 4);
  b.run_for_us(200'000);
  EXPECT_EQ(b.made.size(), 2U);
  EXPECT_EQ(b.made[1].count - b.made[0].count, 10ULL * VirtualBoard::kHz);
}

/// Pulses at 100 Hz with feedback on both lines; `camera` gives what the cameras do after a pulse.
struct WithFeedback : testing::Test {
  VirtualBoard b;
  void begin(std::uint8_t active_low = 0) {
    TriggerConfig c = VirtualBoard::config(100'000);
    c.feedback_inputs = 0x3;
    c.feedback_active_low = active_low;
    b.configure(c);
    b.send(trigger_start);
    b.frames.clear();
  }
  void exposure(unsigned line, std::uint64_t pulse, std::uint64_t start_us, std::uint64_t end_us,
                bool inverted = false) {
    b.edge_at(pulse + start_us * kUs, input(line), !inverted);
    b.edge_at(pulse + end_us * kUs, input(line), inverted);
  }
  static BoardInput input(unsigned line) {
    return static_cast<BoardInput>(board_input_feedback + line);
  }
};

TEST_F(WithFeedback, eventFollowsAllExposuresAndCarriesThem) {
  b.on_pulse = [this](const BoardPulse& p) {
    exposure(0, p.count, 12, 8012);
    exposure(1, p.count, 14, 4000, true);
  };
  begin(0x2);
  b.run_for_us(8'900);
  EXPECT_TRUE(b.frames.empty()) << "line 0 still exposes";
  b.run_for_us(200);
  EXPECT_EQ(b.frames.size(), 1U);
  b.run_for_us(1'000'000);
  const auto events = b.events();
  ASSERT_GT(events.size(), 99U);
  for (const TriggerEvent& e : events) {
    EXPECT_EQ(e.exposure[0].start_us, 12);
    EXPECT_EQ(e.exposure[0].end_us, 8012);
    EXPECT_EQ(e.exposure[1].start_us, 14);
    EXPECT_EQ(e.exposure[1].end_us, 4000);
    EXPECT_EQ(e.exposure[2].start_us, TRIGGER_NOT_SEEN);
  }
}

TEST_F(WithFeedback, exposureBeyondTheIntervalHasNoEnd) {
  b.on_pulse = [this](const BoardPulse& p) {
    // The camera ignores every other pulse.
    if (p.number % 2 == 0) exposure(0, p.count, 10, 14'000);
    exposure(1, p.count, 10, 9'999);
  };
  begin();
  b.run_for_us(200'000);
  const auto events = b.events();
  ASSERT_GT(events.size(), 10U);
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].pulse, i) << "one event a pulse, in order";
    EXPECT_EQ(events[i].exposure[0].start_us, i % 2 == 0 ? 10 : TRIGGER_NOT_SEEN);
    EXPECT_EQ(events[i].exposure[0].end_us, TRIGGER_NOT_SEEN);
    EXPECT_EQ(events[i].exposure[1].end_us, 9'999);
  }
}

TEST_F(WithFeedback, lastEventIsSentAfterStop) {
  begin();
  b.run_for_us(2'000);
  b.send(trigger_stop);
  b.frames.clear();
  b.run_for_us(20'000);
  const auto events = b.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].exposure[0].start_us, TRIGGER_NOT_SEEN);
}

TEST_F(WithFeedback, bouncingLineCountsFirstStartAndFirstEnd) {
  b.on_pulse = [this](const BoardPulse& p) {
    b.edge_at(p.count + 3 * kUs, input(0), false);
    for (const std::uint64_t us : {10U, 20U, 5000U, 5010U})
      b.edge_at(p.count + us * kUs, input(0), us != 5000 && us != 5010);
    exposure(1, p.count, 10, 6000);
    b.edge_at(p.count + 7000 * kUs, input(0), true);
    b.edge_at(p.count + 7100 * kUs, input(0), false);
  };
  begin();
  b.run_for_us(100'000);
  for (const TriggerEvent& e : b.events()) {
    EXPECT_EQ(e.exposure[0].start_us, 10);
    EXPECT_EQ(e.exposure[0].end_us, 5000);
  }
}

TEST_F(WithFeedback, edgeBeforeItsPulseIsIgnored) {
  b.on_pulse = nullptr;
  begin();
  b.run_for_us(2'000);
  ASSERT_EQ(b.made.size(), 1U);
  const std::uint64_t pulse = b.made[0].count;
  // The edge reaches the main loop after the pulse's own record.
  board_edge(&b.board, b.now, input(0), true, pulse - 1);
  exposure(0, pulse, 3000, 4000);
  exposure(1, pulse, 3000, 4000);
  b.run_for_us(5'000);
  const auto events = b.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].exposure[0].start_us, 3000);
}

TEST_F(WithFeedback, edgesBeforeConfigurationAreIgnored) {
  b.edge_at(b.now + 1000, input(0), true);
  b.edge_at(b.now + 2000, input(1), false);
  b.edge_at(b.now + 3000, board_input_pps, true);
  b.edge_at(b.now + 4000, board_input_ins, true);
  b.run_for_us(500'000);
  b.pop(trigger_status);
  EXPECT_TRUE(b.pop(trigger_event).empty());
  EXPECT_EQ(b.status().pps_age_ms, 0U) << "no STATUS was due";
  b.run_for_us(600'000);
  EXPECT_EQ(b.status().pps_age_ms, 0xFFFFFFFFU);
}

TEST(BoardInputs, configuredInsEdgesAreCountedAndStamped) {
  VirtualBoard b;
  TriggerConfig c = VirtualBoard::config(100'000);
  c.ins_edge = trigger_edge_falling;
  b.configure(c);
  for (std::uint64_t k = 0; k < 20; ++k)
    b.edge_at(1'000'000 + (k + 1) * 2500 * kUs, board_input_ins, k % 2 == 0);
  b.run_for_us(100'000);
  const auto reported = b.pop(trigger_ins);
  ASSERT_EQ(reported.size(), 10U);
  for (std::uint32_t k = 0; k < 10; ++k) {
    TriggerEdge e{};
    ASSERT_TRUE(trigger_get_edge(reported[k].payload, reported[k].size, &e));
    EXPECT_EQ(e.boot_id, VirtualBoard::kBootId);
    EXPECT_EQ(e.count, k);
    EXPECT_EQ(e.tick, (2 * k + 2) * 2500U);
  }
}

}  // namespace
}  // namespace vergence
