#include "drivers/trigger_board/board_receiver.hpp"

#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

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
    TriggerEvent e{boot, number, tick, 0, 0, {}};
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

using namespace test;
using Bytes = std::vector<std::uint8_t>;

/// Takes so many ticks from every stamp of the board.
void set_back(Bytes* bytes, std::uint64_t ticks) {
  TriggerFrame f = opened(*bytes);
  TriggerEvent e;
  TriggerPong p;
  if (f.type == trigger_event && trigger_get_event(f.payload, f.size, &e)) {
    e.tick -= ticks;
    trigger_put_event(&e, f.payload);
  } else if (f.type == trigger_pong && trigger_get_pong(f.payload, f.size, &p)) {
    p.received -= ticks, p.sent -= ticks;
    trigger_put_pong(&p, f.payload);
  } else {
    return;
  }
  *bytes = closed(f);
}

/// Result of half a minute with tampered frames, from the fifth second on.
struct Outcome {
  // Number of tampered frames and of EVENTs among them.
  std::uint64_t tampered = 0, events = 0;
  TriggerStatistics statistics;
};
struct Way {
  const char* name;
  // Share of frames that are tampered with.
  double share;
  // True if only EVENTs are tampered with.
  bool events_only;
  void (*tamper)(Random*, Bytes*);
  void (*check)(const Outcome&);
};

struct Hostile : ::testing::TestWithParam<Way> {};

TEST_P(Hostile, costsItsFramesAndCountsEveryNumber) {
  const Way& way = GetParam();
  Random random(3);
  Outcome o;
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {},
               [&](HostStamp at, Bytes* bytes) {
                 const bool event = opened(*bytes).type == trigger_event;
                 if (at <= at_s(5) || (way.events_only && !event) || random.uniform() >= way.share)
                   return;
                 ++o.tampered;
                 o.events += event ? 1 : 0;
                 way.tamper(&random, bytes);
               });
  const auto pulses = rig.drive();
  o.statistics = rig.device->statistics();
  for (std::size_t i = 1; i < pulses.size(); ++i) {
    ASSERT_GT(pulses[i].number, pulses[i - 1].number);
    ASSERT_GT(pulses[i].edge, pulses[i - 1].edge);
    ASSERT_EQ(pulses[i].boot, pulses[0].boot);
  }
  EXPECT_EQ(pulses.size() + o.statistics.lost, pulses.back().number + 1);
  EXPECT_GT(pulses.back().number, 860U) << "to the end";
  EXPECT_EQ(rig.disconnects, 0);
  EXPECT_GT(o.tampered, 20U);
  way.check(o);
}

void fill(Random* random, std::span<std::uint8_t> bytes) {
  for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random->next() >> 24U);
}

INSTANTIATE_TEST_SUITE_P(
    Ways, Hostile,
    ::testing::Values(
        Way{"garbage", 0.01, false, [](Random* random, Bytes* bytes) { fill(random, *bytes); },
            [](const Outcome& o) {
              EXPECT_GE(o.statistics.lost, o.events);
              // An event that came just behind goes with it.
              EXPECT_LE(o.statistics.lost, o.events + o.tampered);
              EXPECT_GE(o.statistics.malformed, 1U);
            }},
        Way{"wrongTypesAndSizes", 0.1, false,
            [](Random* random, Bytes* bytes) {
              TriggerFrame f{};
              f.type = std::array<std::uint8_t, 5>{0x33, 0xFF, trigger_event, trigger_pong,
                                                   trigger_status}[random->below(5)];
              // None has so few but ERROR and the edges, which these types are not.
              f.size = static_cast<std::uint8_t>(random->below(23));
              fill(random, f.payload);
              const Bytes extra = closed(f);
              bytes->insert(bytes->begin(), extra.begin(), extra.end());
            },
            [](const Outcome& o) {
              EXPECT_EQ(o.statistics.lost, 0U);
              EXPECT_LE(o.tampered - o.statistics.malformed, 1U) << "the last may be under way";
            }},
        Way{"eventsThatNeverCame", 0.1, true, [](Random*, Bytes* bytes) { bytes->clear(); },
            [](const Outcome& o) {
              // A lost pulse that was the last one is only noticed with the next report.
              EXPECT_GE(o.statistics.lost + 1, o.events);
              EXPECT_LE(o.statistics.lost, o.events);
            }},
        Way{"ticksThatGoBack", 0.02, false,
            [](Random*, Bytes* bytes) { set_back(bytes, 4'000'000); },
            [](const Outcome& o) {
              EXPECT_GT(o.statistics.malformed, o.events + 20) << "those, and answers to pings";
            }}),
    [](const auto& one) { return one.param.name; });

TEST(InvalidInputBoard, clockSetBackIsFoundAndPulsesContinue) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {}, [](HostStamp at, Bytes* bytes) {
    if (at > at_s(15)) set_back(bytes, 10'000'000);
  });
  const auto all = rig.drive();
  EXPECT_EQ(rig.disconnects, 0);
  for (std::size_t i = 1; i < all.size(); ++i) ASSERT_GT(all[i].number, all[i - 1].number);
  EXPECT_GT(all.back().number, 880U);
  EXPECT_LE(rig.device->statistics().lost, 2U) << "until three pings are answered, 30 ms";
}

TEST(InvalidInputBoard, withoutPongsArrivalsGiveTheTime) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {}, [](HostStamp, Bytes* bytes) {
    if (opened(*bytes).type == trigger_pong) bytes->clear();
  });
  ASSERT_GT(rig.drive().size(), 850U);
  EXPECT_EQ(rig.disconnects, 0);
}

TEST(InvalidInputBoard, lostRequestsAreRepeated) {
  Random random(17);
  BoardRig rig(board_for(Duration::seconds(30)), direct_line());
  int pauses = 0;
  rig.between->lose([&](HostStamp, std::span<const std::uint8_t> bytes) {
    if (opened({bytes.begin(), bytes.end()}).type == trigger_pause) return ++pauses < 3;
    return random.uniform() < 0.3;
  });
  rig.start();
  (void)rig.pulses(10);
  ASSERT_EQ(rig.device->pause(4), DeviceStatus::ok);
  ASSERT_GT(rig.pulses().size(), 820U);
  EXPECT_EQ(rig.disconnects, 0);
  EXPECT_EQ(pauses, 3);
  EXPECT_EQ(rig.device->statistics().lost, 0U);
}

// ---- who is there

/// Answers every frame, under its sequence number.
Talker::Answer answering(std::function<TriggerFrame(const TriggerFrame&)> answer) {
  return [answer = std::move(answer),
          decoder = TriggerDecoder{}](std::span<const std::uint8_t> bytes) mutable {
    Bytes out;
    TriggerFrame f;
    for (const std::uint8_t b : bytes) {
      if (trigger_decode(&decoder, b, &f) != trigger_frame_ready) continue;
      TriggerFrame reply = answer(f);
      reply.sequence = f.sequence;
      const Bytes a = closed(reply);
      out.insert(out.end(), a.begin(), a.end());
    }
    return out;
  };
}

struct Stranger {
  const char* name;
  DeviceStatus status;
  // Words that the error contains.
  std::vector<std::string> words;
  std::string mentions;
  // Answer to every frame.
  std::optional<TriggerFrame> answers{};
};
struct Strangers : ::testing::TestWithParam<Stranger> {};

TEST_P(Strangers, otherDevicesAreNamed) {
  const Stranger& s = GetParam();
  const auto there = std::make_shared<Talker>(
      s.mentions, 921600,
      s.answers ? answering([&s](const TriggerFrame&) { return *s.answers; }) : Talker::Answer{});
  Device device(std::make_unique<test::SimulatedLinkFactory>(there, direct_line()), {});
  EXPECT_EQ(device.connect(), s.status);
  const std::string error = device.last_error();
  for (const std::string& word : s.words) EXPECT_TRUE(test::mentions(error, word));
}

constexpr DeviceStatus kNone = DeviceStatus::not_found, kOther = DeviceStatus::unsupported;
INSTANTIATE_TEST_SUITE_P(
    Lines, Strangers,
    ::testing::Values(
        Stranger{"receiver", kNone, {"NMEA"}, "$GPGGA,130305.0,4717.115,N,00833.912,E,1,08*5B\r\n"},
        Stranger{"ins", kNone, {"Xbus"}, "\xFA\xFF\x36\x03\x10\x20\x01\x99"},
        Stranger{"noise", kNone, {"not frames"}, "\x81\x82\x93\xA4\xB5"},
        Stranger{"silence", kNone, {"no trigger board responds"}, ""},
        // One that answers a HELLO of any version, with an INFO that has grown.
        Stranger{"newerInfo",
                 kOther,
                 {"version 7", "version 1"},
                 "",
                 TriggerFrame{trigger_info, 0, 40, {7}}},
        Stranger{"anotherVersion",
                 kOther,
                 {"version 1"},
                 "",
                 TriggerFrame{trigger_error, 0, 2, {trigger_hello, trigger_error_version}}},
        Stranger{"shortInfo",
                 kOther,
                 {"5 bytes"},
                 "",
                 TriggerFrame{trigger_info, 0, 5, {1, 2, 3, 4, 5}}}),
    [](const auto& one) { return one.param.name; });

TEST(AStubbornBoard, boardIgnoringRequestsIsNamed) {
  // STATUS for everything, always stopped and never configured.
  const auto there =
      std::make_shared<Talker>("", 921600, answering([](const TriggerFrame& f) {
                                 TriggerFrame a{trigger_status, 0, trigger_status_payload_size, {}};
                                 if (f.type != trigger_hello) return a;
                                 TriggerInfo info{};
                                 info.version = 1, info.lines = 2;
                                 a = {trigger_info, 0, trigger_info_payload_size, {}};
                                 trigger_put_info(&info, a.payload);
                                 return a;
                               }));
  Device device(std::make_unique<test::SimulatedLinkFactory>(there, direct_line()), {});
  EXPECT_EQ(device.configure(test::thirty_hertz(), nullptr), DeviceStatus::failed);
  EXPECT_TRUE(test::mentions(device.last_error(), "does not execute"));
}

}  // namespace
}  // namespace vergence::trigger_board
