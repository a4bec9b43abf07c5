// Answers of the board by state.
#include <gtest/gtest.h>

#include "tests/unit/firmware_iface/trigger/board/virtual_board.hpp"

namespace vergence {
namespace {

using Bytes = VirtualBoard::Bytes;

TEST(BoardTalk, invalidMessagesAreAnsweredByErrorCode) {
  VirtualBoard b;
  b.send(trigger_hello, {trigger_protocol_version + 1});
  const auto errors = b.pop(trigger_error);
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_EQ(errors[0].sequence, b.sequence);
  EXPECT_EQ(errors[0].payload[0], trigger_hello);
  EXPECT_EQ(errors[0].payload[1], trigger_error_version);
  b.send(trigger_hello);
  EXPECT_EQ(b.error(), trigger_error_wrong_size);
  b.send(trigger_config, Bytes(17));
  EXPECT_EQ(b.error(), trigger_error_wrong_size);
  for (const std::uint8_t type : Bytes{0, 7, 0x81, 0x90, 0xFF}) {
    b.send(type);
    EXPECT_EQ(b.error(), trigger_error_unknown_type) << int{type};
  }
  b.send(trigger_start);
  EXPECT_EQ(b.error(), trigger_error_not_configured);
  b.pause(3);
  EXPECT_EQ(b.error(), trigger_error_not_running);
  b.send(trigger_stop);
  const TriggerStatus s = b.status();
  EXPECT_EQ(s.state, trigger_stopped);
  EXPECT_EQ(s.frames_refused, 2U) << "the two of a wrong size";
}

TEST(BoardTalk, pongCarriesReceiveAndSendTicks) {
  VirtualBoard b;
  b.run_for_us(1'000'000);
  const Bytes ping = VirtualBoard::framed(trigger_ping, 77, {4, 3, 2, 1});
  const std::uint64_t arrival = b.now;
  for (const std::uint8_t byte : ping) board_receive(&b.board, b.now, arrival, byte);
  // The answer leaves 150 us later.
  b.now += 84ULL * 150;
  b.listen();
  const auto pongs = b.pop(trigger_pong);
  ASSERT_EQ(pongs.size(), 1U);
  EXPECT_EQ(pongs[0].sequence, 77);
  TriggerPong pong{};
  ASSERT_TRUE(trigger_get_pong(pongs[0].payload, pongs[0].size, &pong));
  EXPECT_EQ(pong.token, 0x01020304U);
  EXPECT_EQ(pong.boot_id, VirtualBoard::kBootId);
  EXPECT_EQ(pong.received, 1'000'000U);
  EXPECT_EQ(pong.sent, 1'000'150U);
}

struct Refusal {
  const char* what;
  void (*spoil)(TriggerConfig*);
  int code;
};

TEST(BoardConfig, invalidConfigIsRefusedAndTheOldKept) {
  const Refusal refusals[] = {
      {"no line", [](TriggerConfig* c) { c->lines = 0; }, trigger_error_line},
      {"a fifth line", [](TriggerConfig* c) { c->lines = 0x10; }, trigger_error_line},
      {"polarity of a fifth line", [](TriggerConfig* c) { c->active_low = 0x10; },
       trigger_error_line},
      {"a third feedback", [](TriggerConfig* c) { c->feedback_inputs = 0x4; }, trigger_error_line},
      {"polarity of a third feedback", [](TriggerConfig* c) { c->feedback_active_low = 0x4; },
       trigger_error_line},
      {"both edges of PPS", [](TriggerConfig* c) { c->pps_edge = 3; }, trigger_error_line},
      {"an edge that is none", [](TriggerConfig* c) { c->ins_edge = 200; }, trigger_error_line},
      {"rate 0", [](TriggerConfig* c) { c->rate_millihertz = 0; }, trigger_error_rate},
      {"too fast", [](TriggerConfig* c) { c->rate_millihertz = 1'000'001; }, trigger_error_rate},
      {"varied away", [](TriggerConfig* c) { c->dither_us = 34'000; }, trigger_error_rate},
      {"varied by the most", [](TriggerConfig* c) { c->dither_us = 0xFFFFFFFF; },
       trigger_error_rate},
      {"too fast where shortest", [](TriggerConfig* c) { c->dither_us = 32'400; },
       trigger_error_rate},
      {"no width", [](TriggerConfig* c) { c->pulse_us = 0; }, trigger_error_pulse},
      {"as wide as the interval", [](TriggerConfig* c) { c->pulse_us = 33'334; },
       trigger_error_pulse},
      {"as wide as the shorter interval",
       [](TriggerConfig* c) { c->dither_us = 30'000, c->pulse_us = 3'334; }, trigger_error_pulse},
      {"wider than a second",
       [](TriggerConfig* c) { c->rate_millihertz = 100, c->pulse_us = 1'000'001; },
       trigger_error_pulse},
      {"the widest", [](TriggerConfig* c) { c->pulse_us = 0xFFFFFFFF; }, trigger_error_pulse},
  };
  VirtualBoard b;
  b.configure(VirtualBoard::config(30'000));
  const std::uint32_t good = b.status().configuration;
  EXPECT_NE(good, 0U);
  for (const Refusal& r : refusals) {
    TriggerConfig c = VirtualBoard::config(30'000);
    r.spoil(&c);
    b.configure(c);
    EXPECT_EQ(b.error(), r.code) << r.what;
  }
  b.run_for_us(1'100'000);
  EXPECT_EQ(b.status().configuration, good);
  b.send(trigger_start);
  b.run_for_us(100'000);
  b.frames.clear();
  b.configure(VirtualBoard::config(20'000));
  EXPECT_EQ(b.error(), trigger_error_not_stopped);
}

TEST(BoardConfig, edgesOfAbsentInputsAreRefused) {
  BoardDescription bare = VirtualBoard::usual();
  bare.has_pps = bare.has_ins = false;
  VirtualBoard b(bare);
  TriggerConfig c = VirtualBoard::config(30'000);
  c.pps_edge = trigger_edge_rising;
  b.configure(c);
  EXPECT_EQ(b.error(), trigger_error_line);
  c.pps_edge = trigger_edge_none;
  c.ins_edge = trigger_edge_falling;
  b.configure(c);
  EXPECT_EQ(b.error(), trigger_error_line);
}

TEST(BoardStates, statusIsSentEverySecond) {
  VirtualBoard b;
  b.run_for_us(10'500'000);
  EXPECT_EQ(b.pop(trigger_status).size(), 11U) << "at boot, then every second";
}

TEST(BoardStates, stateChangeIsSentAtOnce) {
  VirtualBoard b;
  b.start(10'000);
  b.run_for_us(50'000);
  // The pause covers the slots at 201, 301, 401 and 501 ms.
  b.pause(4);
  EXPECT_EQ(b.status().state, trigger_paused);
  b.run_for_us(450'000);
  EXPECT_EQ(b.pop(trigger_status).size(), 0U) << "nothing new";
  b.run_for_us(2'000);
  const auto reported = b.pop(trigger_status);
  ASSERT_EQ(reported.size(), 1U) << "the pause has ended by itself";
  TriggerStatus s{};
  ASSERT_TRUE(trigger_get_status(reported[0].payload, reported[0].size, &s));
  EXPECT_EQ(s.state, trigger_running);
}

TEST(BoardStates, stopIsAnsweredAfterAnArmedPulse) {
  VirtualBoard b;
  b.start(100'000);
  ASSERT_TRUE(b.armed);
  b.frames.clear();
  const Bytes stop = VirtualBoard::framed(trigger_stop, 99, {});
  for (const std::uint8_t byte : stop) board_receive(&b.board, b.now, b.now, byte);
  ASSERT_TRUE(board_wants_disarm(&b.board));
  const Bytes again = VirtualBoard::framed(trigger_start, 100, {});
  for (const std::uint8_t byte : again) board_receive(&b.board, b.now, b.now, byte);
  b.listen();
  EXPECT_EQ(b.error(), trigger_error_not_stopped);
  b.now = b.pulse.count;
  b.armed = false;
  board_pulse_made(&b.board, b.now, b.pulse.count, false);
  EXPECT_FALSE(board_wants_disarm(&b.board));
  b.listen();
  ASSERT_EQ(b.frames.size(), 2U);
  EXPECT_EQ(b.frames[0].type, trigger_event);
  EXPECT_EQ(b.frames[1].type, trigger_status);
  EXPECT_EQ(b.frames[1].sequence, 99);
}

TEST(BoardStates, pauseSkipsItsNumbersAndKeepsTheGrid) {
  VirtualBoard b;
  b.start(100'000);
  // Numbers 0 to 4 are out and 5 is armed.
  b.run_for_us(46'500);
  b.pause(7);
  b.run_for_us(200'000);
  const auto events = b.events();
  ASSERT_GT(events.size(), 8U);
  for (std::size_t i = 0; i < events.size(); ++i) {
    const std::uint32_t number = static_cast<std::uint32_t>(i <= 5 ? i : i + 7);
    EXPECT_EQ(events[i].pulse, number);
    EXPECT_EQ(events[i].tick - events[0].tick, number * 10'000U);
    EXPECT_EQ(events[i].flags, i == 0 || i == 6 ? 1 : 0);
  }
}

TEST(BoardStates, pauseOfZeroOrStopEndsAPause) {
  VirtualBoard b;
  b.start(100'000);
  b.run_for_us(20'000);
  b.pause(0xFFFFFFFF);
  b.run_for_us(5'000'000);
  const std::size_t before = b.made.size();
  EXPECT_LE(before, 4U);
  b.pause(0);
  EXPECT_EQ(b.status().state, trigger_running);
  b.run_for_us(55'000);
  EXPECT_GE(b.made.size(), before + 5);
  EXPECT_EQ(b.events().front().flags, 1);
  b.pause(1000);
  b.run_for_us(55'000);
  b.send(trigger_stop);
  EXPECT_EQ(b.status().state, trigger_stopped);
  b.send(trigger_start);
  EXPECT_EQ(b.status().state, trigger_running);
}

}  // namespace
}  // namespace vergence
