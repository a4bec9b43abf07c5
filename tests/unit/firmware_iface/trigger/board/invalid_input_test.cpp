// A bad line, a host that does not listen, one that sends rubbish.
#include <gtest/gtest.h>

#include "tests/unit/firmware_iface/trigger/board/virtual_board.hpp"

namespace vergence {
namespace {

using Bytes = VirtualBoard::Bytes;

TEST(BoardInvalidInput, stalledHostLosesCountedEventsOnly) {
  VirtualBoard b;
  b.start(100'000);
  b.run_for_us(20'000);
  b.frames.clear();
  b.deaf = true;
  b.run_for_us(1'000'000);
  EXPECT_EQ(b.board.outbox.used, outbox_capacity - outbox_for_answers);
  b.send(trigger_ping, {1, 0, 0, 0});
  b.deaf = false;
  b.listen();
  EXPECT_EQ(b.pop(trigger_pong).size(), 1U) << "answers have room of their own";
  b.run_for_us(1'100'000);
  const TriggerStatus s = b.status();
  EXPECT_GT(s.events_dropped, 70U);
  EXPECT_EQ(s.events_dropped, b.board.outbox.dropped);
  EXPECT_GT(s.pulses, 190U) << "pulses go on";
}

TEST(BoardInvalidInput, pingFloodDropsOnlyItsAnswers) {
  VirtualBoard b;
  b.deaf = true;
  for (int i = 0; i < 1000; ++i) b.send(trigger_ping, {1, 0, 0, 0});
  b.deaf = false;
  b.listen();
  EXPECT_EQ(b.pop(trigger_pong).size() + 1, std::size_t{outbox_capacity})
      << "and the STATUS of the start";
  EXPECT_EQ(b.board.outbox.dropped, 1000U - (outbox_capacity - 1));
}

}  // namespace
}  // namespace vergence
