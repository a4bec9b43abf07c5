#include "drivers/trigger_board/device.hpp"

#include "drivers/serial/serial.hpp"
#include "tests/support/mentions.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

using namespace test;

/// Numbers without a hole, in order, stamps that ascend.
void expect_gapless(const std::vector<Pulse>& all) {
  for (std::size_t i = 1; i < all.size(); ++i) {
    ASSERT_EQ(all[i].number, all[i - 1].number + 1) << i;
    ASSERT_GT(all[i].edge, all[i - 1].edge) << i;
  }
}

TEST(Board, isIdentifiedConfiguredAndRead) {
  BoardRig rig(board_for(Duration::seconds(10)));
  ASSERT_EQ(rig.device->connect(), DeviceStatus::ok) << rig.device->last_error();
  EXPECT_EQ(rig.device->info().serial, "30002b000b51333634393138");
  EXPECT_EQ(rig.device->info().model, "trigger board, firmware 1.0.0");
  EXPECT_EQ(rig.device->identity().lines, 4);
  EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::bad_configuration) << "not configured";
  TriggerConfiguration actual;
  ASSERT_EQ(rig.device->configure(thirty_hertz(), &actual), DeviceStatus::ok)
      << rig.device->last_error();
  EXPECT_EQ(actual.rate_hz, 30);
  EXPECT_TRUE(rig.device->remark().empty());
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  ASSERT_GT(all.size(), 280U);
  expect_gapless(all);
  EXPECT_EQ(all.front().number, 0U);
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_EQ(all[i].boot, rig.simulator->boot_id());
    ASSERT_EQ(all[i].resumed, i == 0);
  }
  const TriggerStatistics s = rig.device->statistics();
  EXPECT_EQ(s.pulses, all.size());
  EXPECT_EQ(s.malformed + s.overruns + s.reboots, 0U);
}

TEST(Board, isFoundAtAnyBaudRate) {
  for (const auto& [baud, asked] :
       {std::pair{115200U, 0U}, {460800U, 0U}, {921600U, 0U}, {57600U, 57600U}}) {
    test::BoardSimulatorOptions board = board_for(Duration::seconds(20));
    board.baud = baud;
    BoardRig rig(board, {}, {.baud = asked});
    rig.start();
    EXPECT_EQ(rig.pulses(30).size(), 30U) << baud;
  }
}

TEST(Board, exposureFeedbackComesWithItsPulse) {
  test::BoardSimulatorOptions board = board_for(Duration::seconds(20));
  board.clock_ppm = 0;
  BoardRig rig(board, direct_line());
  rig.exposures = [](const test::SimulatedPulse& p) {
    test::SimulatedExposures e;
    e[0] = {true, p.edge + Duration::microseconds(35), p.edge + Duration::microseconds(8035)};
    e[1] = {p.number % 5 != 3, p.edge + Duration::microseconds(41),
            p.edge + Duration::microseconds(6041 + p.number)};
    return e;
  };
  TriggerConfiguration requested = thirty_hertz();
  requested.feedback = 0x03;
  requested.feedback_active_low = 0x02;
  const auto all = rig.drive(requested);
  ASSERT_GT(all.size(), 500U);
  expect_gapless(all);
  // The tolerance is one tick.
  const auto near_us = [](Duration d, std::int64_t us) {
    return std::abs(d.ns() - us * 1000) <= 1000;
  };
  for (const Pulse& p : all) {
    ASSERT_TRUE(p.exposure[0].seen);
    ASSERT_TRUE(near_us(p.exposure[0].start, 35) && near_us(p.exposure[0].end, 8035)) << p.number;
    ASSERT_EQ(p.exposure[1].seen, p.number % 5 != 3);
    ASSERT_TRUE(!p.exposure[1].seen ||
                (near_us(p.exposure[1].start, 41) &&
                 near_us(p.exposure[1].end, 6041 + static_cast<std::int64_t>(p.number))));
    ASSERT_FALSE(p.exposure[2].seen);
  }
}

TEST(Board, pauseIsAGapWithoutLoss) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line());
  ASSERT_EQ(rig.device->pause(4), DeviceStatus::stopped);
  rig.start();
  auto all = rig.pulses(50);
  ASSERT_EQ(rig.device->pause(4), DeviceStatus::ok);
  // The thread may be as far ahead of us as its ring holds, which is eight seconds.
  const auto rest = rig.pulses();
  all.insert(all.end(), rest.begin(), rest.end());
  int gaps = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const std::uint64_t step = all[i].number - all[i - 1].number;
    ASSERT_EQ(all[i].resumed, step != 1);
    if (step == 1) continue;
    ++gaps;
    EXPECT_EQ(step, 5U);
    EXPECT_NEAR((all[i].edge - all[i - 1].edge).to_seconds(), 5.0 / 30, 1e-4);
  }
  EXPECT_EQ(gaps, 1);
  EXPECT_EQ(rig.device->statistics().lost, 0U);
}

TEST(Board, rebootGivesANewBootAndResumes) {
  test::BoardSimulatorOptions board = board_for(Duration::seconds(40));
  // The restart hits any byte of any frame.
  for (int i = 0; i < 20; ++i) board.reboots.push_back(at_s(10 + i + 0.000'137 * i));
  BoardRig rig(board, direct_line());
  const auto all = rig.drive();
  EXPECT_EQ(rig.disconnects, 0) << "it answers all the while";
  std::size_t boots = 1;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].boot == all[i - 1].boot) {
      ASSERT_EQ(all[i].number, all[i - 1].number + 1);
      continue;
    }
    ++boots;
    EXPECT_EQ(all[i].number, 0U);
    EXPECT_TRUE(all[i].resumed);
    // Boot, a ping, hello, configuration, pings, start.
    EXPECT_LT((rig.truth(all[i]) - rig.truth(all[i - 1])).to_seconds(), 0.3) << i;
  }
  EXPECT_EQ(boots, 21U);
  EXPECT_EQ(rig.device->statistics().reboots, 20U);
}

TEST(Board, numbersContinueAcrossStopsWithoutLoss) {
  for (const std::uint8_t feedback : std::array<std::uint8_t, 2>{0, 1}) {
    BoardRig rig(board_for(Duration::seconds(200)), direct_line());
    rig.exposures = [](const test::SimulatedPulse& p) {
      test::SimulatedExposures e;
      e[0] = {true, p.edge + Duration::microseconds(35), p.edge + Duration::milliseconds(30)};
      return e;
    };
    TriggerConfiguration requested = thirty_hertz();
    requested.feedback = feedback;
    ASSERT_EQ(rig.device->configure(requested, nullptr), DeviceStatus::ok);
    std::uint64_t next = 0;
    for (int i = 0; i < 10; ++i) {
      ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
      const auto all = rig.pulses(3);
      ASSERT_EQ(all.size(), 3U);
      EXPECT_GE(all.front().number, next);
      EXPECT_TRUE(all.front().resumed);
      expect_gapless(all);
      next = all.back().number + 1;
      rig.device->stop();
      const std::uint64_t made = rig.simulator->pulses_made();
      (void)rig.place->pass(Duration::seconds(1));
      EXPECT_EQ(rig.simulator->pulses_made(), made) << "no pulse after it has stopped";
    }
    EXPECT_EQ(rig.device->statistics().lost, 0U);
    EXPECT_TRUE(feedback != 0 || rig.device->statistics().pulses == rig.simulator->pulses_made());
  }
}

TEST(Board, runningBoardIsStoppedBeforeConfiguration) {
  BoardRig rig(board_for(Duration::seconds(100)), direct_line());
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  // Somebody started it and went away.
  const std::vector<std::uint8_t> start = closed({trigger_start, 9, 0, {}});
  rig.simulator->receive(start, at_s(5));
  (void)rig.place->pass(Duration::seconds(8));
  ASSERT_GT(rig.simulator->pulses_made(), 50U);
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  const std::uint64_t made = rig.simulator->pulses_made();
  (void)rig.place->pass(Duration::seconds(1));
  EXPECT_EQ(rig.simulator->pulses_made(), made);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(rig.pulses(30).front().number, made);
  EXPECT_EQ(rig.device->statistics().lost, 0U) << "those were not ours";
}

TEST(Board, stoppedBoardIsStartedAgain) {
  std::shared_ptr<test::BoardSimulator> simulator;
  bool done = false;
  BoardRig rig(board_for(Duration::seconds(20)), direct_line(), {},
               [&](HostStamp at, std::vector<std::uint8_t>*) {
                 if (done || at < at_s(6)) return;
                 done = true;
                 simulator->receive(closed({trigger_stop, 9, 0, {}}), at);
               });
  simulator = rig.simulator;
  const auto all = rig.drive();
  expect_gapless(all);
  EXPECT_GT(rig.truth(all.back()), at_s(19.8));
  EXPECT_EQ(rig.device->statistics().reboots, 0U);
}

TEST(Board, otherBoardOnThePortIsRefused) {
  test::SimulatedLineOptions line{.outages = {{at_s(10), at_s(11)}, {at_s(20), at_s(21)}}};
  BoardRig rig(board_for(Duration::seconds(60)), line, {},
               [&](HostStamp at, std::vector<std::uint8_t>* bytes) {
                 TriggerFrame f = opened(*bytes);
                 if (at <= at_s(10) || at >= at_s(20) || f.type != trigger_info) return;
                 // The byte is part of the serial number.
                 f.payload[27] ^= 1U;
                 *bytes = closed(f);
               });
  const auto all = rig.drive();
  EXPECT_EQ(rig.disconnects, 1) << "disconnected while the other is there";
  for (const Pulse& p : all) EXPECT_FALSE(rig.truth(p) > at_s(10.5) && rig.truth(p) < at_s(20));
  EXPECT_GT(rig.truth(all.back()), at_s(59));
}

// ---- what is asked

TEST(Configuration, invalidValueIsRefusedWithItsKey) {
  using C = TriggerConfiguration;
  constexpr DeviceStatus kBad = DeviceStatus::bad_configuration,
                         kUnsupported = DeviceStatus::unsupported;
  struct Refusal {
    void (*change)(C*);
    DeviceStatus status;
    const char* key;
    Options options{};
  };
  test::BoardSimulatorOptions board = board_for(Duration::seconds(100));
  board.lines = 2;
  board.feedback_inputs = 1;
  board.has_pps = board.has_ins = false;
  for (const Refusal& r : {
           Refusal{[](C* c) { c->rate_hz = 0; }, kBad, "trigger.rate"},
           Refusal{[](C* c) { c->rate_hz = NAN; }, kBad, "trigger.rate"},
           Refusal{[](C* c) { c->rate_hz = 1500; }, kUnsupported, "trigger.rate"},
           Refusal{[](C* c) { c->width = {}; }, kBad, "trigger.width_us"},
           Refusal{[](C* c) { c->rate_hz = 0.1, c->width = Duration::seconds(2); }, kBad,
                   "trigger.width_us"},
           Refusal{[](C* c) { c->width = Duration::milliseconds(40); }, kBad, "trigger.width_us"},
           Refusal{[](C* c) { c->vary = Duration::milliseconds(34); }, kBad, "trigger.dither_us"},
           Refusal{[](C* c) { c->lines = 0; }, kBad, "trigger.lines"},
           Refusal{[](C* c) { c->lines = 0x05; }, kUnsupported, "trigger.lines"},
           Refusal{[](C* c) { c->feedback = 0x03; }, kUnsupported, "trigger.feedback"},
           Refusal{[](C*) {}, kUnsupported, "trigger.pps", {.pps = Edge::rising}},
           Refusal{[](C*) {}, kUnsupported, "trigger.ins", {.ins = Edge::rising}},
       }) {
    SCOPED_TRACE(r.key);
    BoardRig rig(board, {}, r.options);
    TriggerConfiguration requested = thirty_hertz();
    r.change(&requested);
    EXPECT_EQ(rig.device->configure(requested, nullptr), r.status);
    EXPECT_TRUE(mentions(rig.device->last_error(), r.key));
    EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::bad_configuration);
    if (r.options.pps != Edge::none || r.options.ins != Edge::none) continue;
    EXPECT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
        << "and it can still be set otherwise";
    EXPECT_TRUE(rig.device->last_error().empty());
  }
}

struct JoinedBoard {
  using Item = Pulse;
  static constexpr double kRate = 30;
  JoinedBoard(const test::SimulatedLineOptions& line, Duration duration,
              test::Tampered::Tamper tamper)
      : rig(board_for(duration), line, {}, std::move(tamper)) {}
  DeviceStatus configure() { return rig.device->configure(thirty_hertz(), nullptr); }
  Device& device() { return *rig.device; }
  static std::pair<std::uint64_t, DeviceStamp> order(const Pulse& p) { return {p.number, p.edge}; }
  BoardRig rig;
};

/// A machine with ports: at some of them boards, at the others nothing that answers.
struct Machine {
  struct Port {
    SerialPortInfo info;
    // Null if the port does not open.
    std::shared_ptr<test::DeviceModel> device;
  };
  std::vector<Port> ports;

  void add_board(const char* port, std::uint8_t last_of_serial) {
    test::BoardSimulatorOptions o;
    o.serial[11] = last_of_serial;
    // A board's own USB supports every rate; this one supports the first only.
    o.baud = 115200;
    ports.push_back({{port, "", 0x0483, 0x5740, "", {}},
                     std::make_shared<test::BoardSimulator>(test::PulseSource{}, o)});
  }
  void add(const char* port, std::uint16_t vendor, std::uint16_t product) {
    ports.push_back(
        {{port, "", vendor, product, "", {}}, std::make_shared<test::Talker>("", 115200)});
  }
  std::vector<std::string> asked;
  Driver driver() {
    return Driver({}, {[this] {
                         std::vector<SerialPortInfo> list;
                         for (const Port& p : ports) list.push_back(p.info);
                         return list;
                       },
                       [this](const std::string& name) -> std::unique_ptr<SerialLinkFactory> {
                         asked.push_back(name);
                         for (const Port& p : ports)
                           if (p.info.port == name && p.device != nullptr)
                             return std::make_unique<test::SimulatedLinkFactory>(
                                 p.device, test::direct_line());
                         return std::make_unique<SerialPort>("/dev/ttyThatIsNotThere");
                       }});
  }
};

TEST(Driver, listsBoardsWithoutAskingAnIns) {
  Machine m;
  m.add("/dev/ttyS0", 0, 0);
  m.add("/dev/ttyUSB0", 0x0403, 0xD388);
  m.add("/dev/ttyUSB1", 0x2639, 0x0300);
  m.add("/dev/ttyUSB2", 0x0403, 0x6001);
  m.add_board("/dev/ttyACM0", 0xAA);
  m.add_board("/dev/ttyACM1", 0xBB);
  m.ports.push_back({{"/dev/ttyUSB9", "", 0x0403, 0x6001, "", {}}, nullptr});
  Driver driver = m.driver();
  const auto found = driver.enumerate();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].serial, "30002b000b513336343931aa");
  EXPECT_EQ(found[1].serial, "30002b000b513336343931bb");
  EXPECT_EQ(found[0].driver, "board");
  EXPECT_EQ(m.asked, (std::vector<std::string>{"/dev/ttyUSB2", "/dev/ttyACM0", "/dev/ttyACM1",
                                               "/dev/ttyUSB9"}));
}

TEST(Driver, opensByPortSerialNumberOrTheOnlyBoard) {
  Machine m;
  m.add_board("/dev/ttyACM0", 0xAA);
  Driver driver = m.driver();
  DeviceStatus s = DeviceStatus::failed;
  EXPECT_NE(driver.open("", &s), nullptr) << driver.last_error();
  EXPECT_EQ(s, DeviceStatus::ok);
  EXPECT_NE(driver.open("/dev/ttyACM0", &s), nullptr);
  m.add_board("/dev/ttyACM1", 0xBB);
  EXPECT_EQ(driver.open("", &s), nullptr);
  EXPECT_EQ(s, DeviceStatus::bad_configuration)
      << "the configuration does not say which of the two";
  EXPECT_TRUE(test::mentions(driver.last_error(), "trigger.port"));
  const auto one = driver.open("30002b000b513336343931bb", &s);
  ASSERT_NE(one, nullptr) << driver.last_error();
  EXPECT_EQ(one->info().serial, "30002b000b513336343931bb");
  EXPECT_EQ(driver.open("30002b000b513336343931cc", &s), nullptr);
  EXPECT_EQ(s, DeviceStatus::not_found);
  EXPECT_TRUE(test::mentions(driver.last_error(), "30002b000b513336343931cc"));
}

}  // namespace
}  // namespace vergence::trigger_board

namespace vergence::test {
INSTANTIATE_TYPED_TEST_SUITE_P(Board, SerialConformance, trigger_board::JoinedBoard);
}  // namespace vergence::test
