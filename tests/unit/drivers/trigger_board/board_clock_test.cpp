#include "drivers/trigger_board/board_receiver.hpp"

#include <gtest/gtest.h>

#include "drivers/trigger_board/pulse_account.hpp"

namespace vergence::trigger_board {
namespace {

constexpr std::int64_t kZero = 5'000'000'000;  // host time of tick 0, ns

HostStamp host(std::int64_t us) { return HostStamp(kZero + us * 1000); }
TriggerPong pong(std::uint32_t token, std::uint64_t received, std::uint64_t sent) {
  return {token, 1, received, sent};
}

TEST(BoardClock, oneAnswerSaysTheTimeWithinHalfItsRoundTrip) {
  BoardClock clock;
  clock.restart(Duration::milliseconds(4), false);
  EXPECT_FALSE(clock.known());
  const std::uint32_t token = clock.ask(host(1000));
  ASSERT_EQ(clock.answer(pong(token, 1300, 1350), host(1650)), PongWord::taken);
  ASSERT_TRUE(clock.known());
  const MappedStamp m = clock.map(stamp_of_tick(1320), host(2000));
  EXPECT_LE(std::abs((m.host - host(1320)).ns()), m.error.ns());
  const TimeQuality q = clock.quality();
  EXPECT_EQ(q.rtt_least, Duration::microseconds(600));
  EXPECT_EQ(q.rtt_median, Duration::microseconds(600));
  EXPECT_EQ(q.asked, 1U);
  EXPECT_EQ(q.answered, 1U);
}

TEST(BoardClock, whatBytesTakeOnTheWireIsNoRoundTrip) {
  BoardClock clock;
  clock.reopen(Duration::microseconds(10));
  // A PING of 13 bytes with nothing else between.
  const std::uint32_t token = clock.ask(host(1000));
  ASSERT_EQ(clock.answer(pong(token, 1130, 1130), host(1130)), PongWord::taken);
  EXPECT_EQ(clock.quality().rtt_least, Duration{});
  EXPECT_LE(std::abs((clock.map(stamp_of_tick(1130), host(2000)).host - host(1130)).ns()), 1000);
}

TEST(BoardClock, answersThatCannotBeAreRefused) {
  BoardClock clock;
  EXPECT_EQ(clock.answer(pong(77, 10, 20), host(30)), PongWord::unasked);
  const std::uint32_t a = clock.ask(host(100));
  EXPECT_EQ(clock.answer(pong(a, 300, 200), host(400)), PongWord::invalid)
      << "sent before received";
  EXPECT_EQ(clock.answer(pong(a, 200, 300), host(400)), PongWord::unasked)
      << "it has been answered";
  const std::uint32_t b = clock.ask(host(1000));
  EXPECT_EQ(clock.answer(pong(b, 1000, 9000), host(2000)), PongWord::invalid)
      << "longer in the board than under way";
  const std::uint32_t c = clock.ask(host(3000));
  EXPECT_EQ(clock.answer(pong(c, kMostTicks, kMostTicks + 1), host(4000)), PongWord::invalid);
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.quality().refused, 5U);
}

}  // namespace
}  // namespace vergence::trigger_board
