#include "drivers/trigger_board/board_receiver.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace vergence::trigger_board {
namespace {

constexpr std::uint64_t kPeriod = 33'333;
constexpr std::uint32_t kBoot = 7, kMark = 0x1234;

TriggerFrame frame_of(std::uint8_t type, std::size_t size) {
  TriggerFrame frame{};
  frame.type = type;
  frame.size = static_cast<decltype(frame.size)>(size);
  return frame;
}

/// A receiver whose board was set up, and streams.
struct Receiving : ::testing::Test {
  Receiving() {
    TriggerConfig config{};
    config.rate_millihertz = 30'000;
    receiver.expect_configuration(kMark);
    receiver.begin_boot(kBoot, 0, config, Duration::milliseconds(4));
    receiver.stream(HostStamp(0));
  }
  void event(std::uint32_t number, std::uint64_t tick, std::uint32_t boot = kBoot) {
    TriggerEvent e{};
    e.boot_id = boot;
    e.pulse = number;
    e.tick = tick;
    for (TriggerExposure& x : e.exposure) x = {TRIGGER_NOT_SEEN, TRIGGER_NOT_SEEN};
    TriggerFrame frame = frame_of(trigger_event, trigger_event_payload_size);
    trigger_put_event(&e, frame.payload);
    accept(frame);
  }
  void accept(const TriggerFrame& frame) {
    arrival = arrival + Duration::milliseconds(1);
    receiver.accept(frame, {arrival, arrival});
  }

  using Finding = BoardReceiver::Finding;
  HostStamp arrival{};
  std::vector<Pulse> pulses;
  PauseRequest pause;
  BoardReceiver receiver{pause, [this](const Pulse& p) { pulses.push_back(p); }};
};

TEST_F(Receiving, nothingIsDeliveredDuringSetup) {
  receiver.hold();
  event(0, kPeriod);
  event(0, kPeriod, kBoot + 1);
  EXPECT_TRUE(pulses.empty());
  EXPECT_EQ(receiver.finding(), Finding::none) << "a change of the board is none yet";
}

TEST_F(Receiving, repeatedImpossibleNumbersAreInvalid) {
  event(5, 6 * kPeriod);
  for (int i = 1; i < BoardReceiver::kMaxRefused; ++i) event(5, 6 * kPeriod);
  EXPECT_EQ(receiver.finding(), Finding::none) << "one fewer than it takes";
  event(5, 6 * kPeriod);
  EXPECT_EQ(receiver.finding(), Finding::invalid);
  EXPECT_EQ(pulses.size(), 1U);
}

TEST_F(Receiving, wrongTickRecoversAfterSetup) {
  for (std::uint32_t n = 0; n < 10; ++n) event(n, (n + 1) * kPeriod);
  event(10, 11 * kPeriod + (std::uint64_t{1} << 32U));
  for (std::uint32_t n = 11; receiver.finding() == Finding::none && n < 100; ++n)
    event(n, (n + 1) * kPeriod);
  ASSERT_EQ(receiver.finding(), Finding::invalid);
  const std::size_t before = pulses.size();
  receiver.clear_finding();
  TriggerConfig config{};
  config.rate_millihertz = 30'000;
  receiver.begin_boot(kBoot, 100, config, {});
  for (std::uint32_t n = 100; n < 120; ++n) event(n, (n + 1) * kPeriod);
  EXPECT_EQ(pulses.size(), before + 20);
  EXPECT_EQ(receiver.finding(), Finding::none);
}

// Host time of tick 0 in ns.
constexpr std::int64_t kZero = 5'000'000'000;

HostStamp host(std::int64_t us) { return HostStamp(kZero + us * 1000); }
TriggerPong pong(std::uint32_t token, std::uint64_t received, std::uint64_t sent) {
  return {token, 1, received, sent};
}

TEST(BoardClock, impossibleAnswersAreRefused) {
  BoardClock clock;
  EXPECT_EQ(clock.answer(pong(77, 10, 20), host(30)), PongStatus::unasked);
  const std::uint32_t a = clock.ask(host(100));
  EXPECT_EQ(clock.answer(pong(a, 300, 200), host(400)), PongStatus::invalid)
      << "sent before received";
  EXPECT_EQ(clock.answer(pong(a, 200, 300), host(400)), PongStatus::unasked)
      << "it has been answered";
  const std::uint32_t b = clock.ask(host(1000));
  EXPECT_EQ(clock.answer(pong(b, 1000, 9000), host(2000)), PongStatus::invalid)
      << "longer in the board than under way";
  const std::uint32_t c = clock.ask(host(3000));
  EXPECT_EQ(clock.answer(pong(c, kMaxTicks, kMaxTicks + 1), host(4000)), PongStatus::invalid);
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.refused(), 5U);
}

}  // namespace
}  // namespace vergence::trigger_board
