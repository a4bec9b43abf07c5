// The image that is flashed, in an emulated machine, spoken to over its line.
#include <gtest/gtest.h>

#include "tests/unit/firmware_iface/trigger/board/qemu_board.hpp"

namespace vergence {
namespace {

using Bytes = QemuBoard::Bytes;
using namespace std::chrono_literals;

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

}  // namespace
}  // namespace vergence
