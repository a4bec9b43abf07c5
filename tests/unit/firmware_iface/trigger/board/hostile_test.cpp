// A bad line, a host that does not listen, one that sends rubbish.
#include <gtest/gtest.h>

#include "tests/unit/firmware_iface/trigger/board/virtual_board.hpp"

namespace vergence {
namespace {

using Bytes = VirtualBoard::Bytes;

TEST(BoardHostile, aHostThatDoesNotListenCostsMessagesWhichAreCountedAndThenItIsAnswered) {
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
  EXPECT_EQ(b.take(trigger_pong).size(), 1U) << "answers have room of their own";
  b.run_for_us(1'100'000);
  const TriggerStatus s = b.status();
  EXPECT_GT(s.events_dropped, 70U);
  EXPECT_EQ(s.events_dropped, b.board.outbox.dropped);
  EXPECT_GT(s.pulses, 190U) << "pulses go on";
}

TEST(BoardHostile, aFloodOfPingsDropsAnswersAndNothingElse) {
  VirtualBoard b;
  b.deaf = true;
  for (int i = 0; i < 1000; ++i) b.send(trigger_ping, {1, 0, 0, 0});
  b.deaf = false;
  b.listen();
  EXPECT_EQ(b.take(trigger_pong).size() + 1, std::size_t{outbox_capacity})
      << "and the STATUS of the start";
  EXPECT_EQ(b.board.outbox.dropped, 1000U - (outbox_capacity - 1));
}

TEST(BoardHostile, aRebootInMidFrameIsAnotherBootAndNumbersFromZero) {
  VirtualBoard b;
  b.start(100'000);
  b.run_for_us(55'000);
  std::uint8_t out[trigger_max_frame];
  b.frames.clear();
  const Bytes half = VirtualBoard::framed(trigger_config, 5, Bytes(trigger_config_payload_size, 3));
  for (std::size_t i = 0; i < half.size() / 2; ++i) board_receive(&b.board, b.now, b.now, half[i]);
  // The board's own frame is cut as well: the host's decoder has half of it when the new board
  // speaks.
  while (board_send(&b.board, b.now, out) > 0) {
  }
  TriggerFrame frame{};
  for (int i = 0; i < 20; ++i)
    (void)trigger_decode(&b.host, static_cast<std::uint8_t>(7 + i), &frame);
  const BoardDescription usual = VirtualBoard::usual();
  board_init(&b.board, &usual, 0x12345678, b.now);
  b.armed = false;
  for (std::size_t i = half.size() / 2; i < half.size(); ++i)
    board_receive(&b.board, b.now, b.now, half[i]);
  b.run_for_us(1'100'000);
  const TriggerStatus s = b.status();
  EXPECT_EQ(s.boot_id, 0x12345678U);
  EXPECT_EQ(s.pulses, 0U);
  EXPECT_EQ(s.configuration, 0U);
  EXPECT_EQ(s.state, trigger_stopped);
  EXPECT_EQ(s.frames_refused, 1U);
  EXPECT_EQ(b.host.bad_coding + b.host.bad_length + b.host.bad_crc, 1U)
      << "the cut frame, and only it";
}

TEST(BoardHostile, edgesLostBeforeTheCoreAreInTheStatus) {
  VirtualBoard b;
  board_edges_lost(&b.board, 17);
  b.run_for_us(1'100'000);
  EXPECT_EQ(b.status().edges_dropped, 17U);
}

}  // namespace
}  // namespace vergence
