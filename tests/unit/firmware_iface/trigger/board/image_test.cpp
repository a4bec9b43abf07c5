// The image that is flashed, in an emulated machine, spoken to over its line.
#include <gtest/gtest.h>

#include "tests/unit/firmware_iface/trigger/board/qemu_board.hpp"

namespace vergence {
namespace {

using Bytes = QemuBoard::Bytes;
using namespace std::chrono_literals;

constexpr double kBoardPerHost =
    1e9 / 16e6;  // the machine's timers against the clock that the image fell back to
constexpr double kCountsPerTick = 16;

struct TriggerBoardImage : testing::Test {
  void SetUp() override {
    const std::string why = QemuBoard::missing();
    if (!why.empty()) GTEST_SKIP() << why;
  }
  static Bytes config(std::uint32_t millihertz, std::uint32_t vary_us = 0) {
    TriggerConfig c{};
    c.rate_millihertz = millihertz;
    c.pulse_us = 2000;
    c.vary_us = vary_us;
    c.lines = 0x3;
    c.pps_edge = trigger_edge_rising;
    c.ins_edge = trigger_edge_falling;
    Bytes payload(trigger_config_payload_size);
    trigger_put_config(&c, payload.data());
    return payload;
  }
  static TriggerStatus status(const TriggerFrame& f) {
    TriggerStatus s{};
    EXPECT_TRUE(f.type == trigger_status && trigger_get_status(f.payload, f.size, &s));
    return s;
  }
  static TriggerEvent event(const TriggerFrame& f) {
    TriggerEvent e{};
    EXPECT_TRUE(f.type == trigger_event && trigger_get_event(f.payload, f.size, &e));
    return e;
  }
  static TriggerEdge edge(const TriggerFrame& f) {
    TriggerEdge e{};
    EXPECT_TRUE(trigger_get_edge(f.payload, f.size, &e));
    return e;
  }
  static TriggerPong pong(const TriggerFrame& f) {
    TriggerPong p{};
    EXPECT_TRUE(f.type == trigger_pong && trigger_get_pong(f.payload, f.size, &p));
    return p;
  }
};

TEST_F(TriggerBoardImage, saysWhatItIsAndRefusesWhatItIsNot) {
  QemuBoard board;
  const TriggerFrame hello = board.ask(trigger_hello, {trigger_protocol_version});
  TriggerInfo info{};
  ASSERT_EQ(hello.type, trigger_info);
  ASSERT_TRUE(trigger_get_info(hello.payload, hello.size, &info));
  EXPECT_EQ(info.version, trigger_protocol_version);
  EXPECT_NE(info.boot_id, 0U);
  EXPECT_EQ(info.tick_hz, 16'000'000U) << "the crystal was waited for in vain";
  EXPECT_EQ(info.lines, 4);
  EXPECT_EQ(info.feedback_inputs, 2);
  EXPECT_EQ(status(board.wait(trigger_status)).boot_id, info.boot_id);

  const TriggerFrame refused = board.ask(trigger_config, config(0));
  EXPECT_EQ(refused.type, trigger_error);
  EXPECT_EQ(refused.payload[1], trigger_error_rate);
  const Bytes good = config(1000);
  EXPECT_EQ(status(board.ask(trigger_config, good)).configuration,
            trigger_crc32(good.data(), good.size()));
}

TEST_F(TriggerBoardImage, pulsesAreNumberedWithoutGapThroughStopAndStart) {
  QemuBoard board(3);
  (void)board.ask(trigger_config, config(20'000, 5'000));
  const TriggerStatus started = status(board.ask(trigger_start));
  EXPECT_EQ(started.state, trigger_running);
  TriggerEvent last{};
  for (std::uint32_t k = 0; k < 40; ++k) {
    const TriggerEvent e = event(board.wait(trigger_event));
    EXPECT_EQ(e.boot_id, started.boot_id);
    EXPECT_EQ(e.pulse, k);
    EXPECT_EQ(e.lines, 0x3);
    EXPECT_EQ(e.flags & 1, k == 0 ? 1 : 0);
    EXPECT_EQ(e.flags & 2, 2) << "this machine's compare unit makes no edges: the main loop did";
    EXPECT_EQ(e.exposure[0].start_us, TRIGGER_NOT_SEEN);
    EXPECT_TRUE(k == 0 || e.tick > last.tick);
    last = e;
  }
  const TriggerStatus paused = status(board.ask(trigger_pause, {20, 0, 0, 0}));
  EXPECT_EQ(paused.state, trigger_paused);
  const TriggerFrame resumed = board.wait(
      [](const TriggerFrame& f) { return f.type == trigger_event && (event(f).flags & 1) != 0; });
  EXPECT_GE(event(resumed).pulse, paused.pulses + 20)
      << "counted from the armed one, which still went out";
  EXPECT_LE(event(resumed).pulse, paused.pulses + 21);

  const TriggerStatus stopped = status(board.ask(trigger_stop));
  EXPECT_EQ(stopped.state, trigger_stopped);
  (void)board.drain();
  (void)board.wait(trigger_status);
  (void)board.wait(trigger_status);
  const TriggerStatus later = status(board.wait(trigger_status));
  EXPECT_EQ(later.pulses, stopped.pulses) << "no pulse after STOP";
  (void)board.ask(trigger_start);
  const TriggerEvent again = event(board.wait(trigger_event));
  EXPECT_EQ(again.pulse, stopped.pulses);
  EXPECT_EQ(again.flags & 1, 1);
}

TEST_F(TriggerBoardImage, pingBracketsTheBoardsTicksBetweenTheHosts) {
  QemuBoard board;
  struct Exchange {
    double sent, heard, received,
        answered;  // seconds; the latter two of the board's, brought to the host's
  };
  std::vector<Exchange> exchanges;
  const auto now = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  for (std::uint8_t k = 0; k < 60; ++k) {
    const double sent = now();
    const TriggerFrame f = board.ask(trigger_ping, {k, 1, 2, 3});
    const double heard = std::chrono::duration<double>(board.arrival().time_since_epoch()).count();
    const TriggerPong p = pong(f);
    EXPECT_EQ(p.token, 0x03020100U + k);
    ASSERT_LE(p.received, p.sent);
    exchanges.push_back({sent, heard, static_cast<double>(p.received) / 1e6 / kBoardPerHost,
                         static_cast<double>(p.sent) / 1e6 / kBoardPerHost});
    std::this_thread::sleep_for(5ms);
  }
  // One offset must fit all: board = host − offset with sent ≤ received + offset and answered +
  // offset ≤ heard.
  double low = -1e300, high = 1e300;
  for (const Exchange& e : exchanges) {
    low = std::max(low, e.sent - e.received);
    high = std::min(high, e.heard - e.answered);
  }
  EXPECT_LE(low, high) << "the board's clock runs at another rate than its machine's";
}

TEST_F(TriggerBoardImage, edgesOfPpsAndInsAreStampedBetweenTwoLooksAtTheCounter) {
  QemuBoard board(3);
  (void)board.ask(trigger_config, config(1000));
  struct Look {
    std::uint32_t before, after;
    std::uint64_t tick;
  };
  for (const auto& [line, type] : {std::pair{6U, trigger_pps}, std::pair{7U, trigger_ins}}) {
    std::vector<Look> looks;
    bool active = type == trigger_pps;  // INS: falling edges count
    board.set_exti(line, !active);
    for (std::uint32_t k = 0; k < 8; ++k) {
      const std::uint32_t before = board.counter();
      board.set_exti(line, active);
      const TriggerEdge e = edge(board.wait(static_cast<std::uint8_t>(type)));
      looks.push_back({before, board.counter(), e.tick});
      EXPECT_EQ(e.count, k);
      board.set_exti(line, !active);  // the other edge: not reported
    }
    // Between two edges as much time has passed as their looks allow; half a tick of rounding at
    // each end.
    for (std::size_t k = 1; k < looks.size(); ++k) {
      const auto ticks = static_cast<double>(looks[k].tick - looks[k - 1].tick);
      const double least = (looks[k].before - looks[k - 1].after) / kCountsPerTick;
      const double most = (looks[k].after - looks[k - 1].before) / kCountsPerTick;
      EXPECT_GE(ticks, least - 1);
      EXPECT_LE(ticks, most + 1);
    }
  }
}

TEST_F(TriggerBoardImage, aResetInMidFrameIsAnotherBootThatKnowsNothing) {
  QemuBoard board(3);
  (void)board.ask(trigger_config, config(1000));
  const TriggerStatus first = status(board.ask(trigger_start));
  (void)board.wait(trigger_event);
  Bytes frame(trigger_max_frame);
  const Bytes payload = config(1000);
  frame.resize(
      trigger_write_frame(trigger_config, 9, payload.data(), payload.size(), frame.data()));
  const Bytes half(frame.begin(), frame.begin() + 12), rest(frame.begin() + 12, frame.end());
  board.bytes(half);
  (void)board.wait(trigger_event);  // so the half has been taken in
  std::uint32_t boot = first.boot_id;
  for (int k = 0; k < 3; ++k) {
    board.reset();
    (void)board.wait([&](const TriggerFrame& f) {
      return f.type == trigger_status && status(f).boot_id != boot;
    });
    if (k == 0) board.bytes(rest);
    const TriggerFrame hello = board.ask(trigger_hello, {trigger_protocol_version});
    TriggerInfo info{};
    ASSERT_TRUE(hello.type == trigger_info && trigger_get_info(hello.payload, hello.size, &info));
    EXPECT_NE(info.boot_id, boot);
    boot = info.boot_id;
    (void)board.drain();
    const TriggerStatus s = status(board.wait(trigger_status));
    EXPECT_EQ(s.boot_id, boot);
    EXPECT_EQ(s.pulses, 0U);
    EXPECT_EQ(s.configuration, 0U);
    EXPECT_EQ(s.state, trigger_stopped);
    const TriggerFrame refused = board.ask(trigger_start);
    EXPECT_EQ(refused.type, trigger_error);
    EXPECT_EQ(refused.payload[1], trigger_error_not_configured);
    (void)board.ask(trigger_config, config(1000));
    (void)board.ask(trigger_start);
    EXPECT_EQ(event(board.wait(trigger_event)).pulse, 0U);
  }
}

}  // namespace
}  // namespace vergence
