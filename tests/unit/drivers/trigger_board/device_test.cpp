#include "drivers/trigger_board/device.hpp"

#include <gtest/gtest.h>

#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

using test::board_for;
using test::BoardRig;
using test::closed;
using test::direct_line;
using test::opened;
using test::thirty_hertz;

HostStamp at_s(double s) { return HostStamp{} + Duration::seconds(s); }

/// Numbers without a hole, in order, stamps that ascend.
void expect_gapless(const std::vector<Pulse>& all) {
  for (std::size_t i = 1; i < all.size(); ++i) {
    ASSERT_EQ(all[i].number, all[i - 1].number + 1) << i;
    ASSERT_GT(all[i].edge, all[i - 1].edge) << i;
  }
}

TEST(Board, isMetSetAndRead) {
  BoardRig rig(board_for(Duration::seconds(10)));
  ASSERT_EQ(rig.device->connect(), DeviceStatus::ok) << rig.device->last_error();
  EXPECT_EQ(rig.device->info().serial, "30002b000b51333634393138");
  EXPECT_EQ(rig.device->info().model, "trigger board, firmware 1.0.0");
  EXPECT_EQ(rig.device->identity().lines, 4);
  Pulse p;
  EXPECT_EQ(rig.device->wait(Duration{}, &p), DeviceStatus::stopped);
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
  EXPECT_TRUE(all.front().resumed);
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_TRUE(all[i].mapped);
    ASSERT_EQ(all[i].boot, rig.simulator->boot_id());
    ASSERT_EQ(all[i].resumed, i == 0);
    ASSERT_LE(std::abs((all[i].host - rig.truth(all[i])).ns()), all[i].host_error.ns()) << i;
  }
  const TriggerStatistics s = rig.device->statistics();
  EXPECT_EQ(s.pulses, all.size());
  EXPECT_EQ(s.malformed + s.overruns + s.reboots, 0U);
  EXPECT_EQ(s.starts, 1U);
}

TEST(Board, tellsEveryPulseOfTenMinutes) {
  BoardRig rig(board_for(Duration::seconds(600)), direct_line());
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  expect_gapless(all);
  // The last report may be on the wire when the board's time is over.
  ASSERT_GE(all.size() + 1, rig.simulator->pulses_made());
  ASSERT_GT(all.size(), 17'900U);
  EXPECT_EQ(rig.device->statistics().lost, 0U);
  EXPECT_EQ(rig.times_gone, 0);
  const TimeQuality t = rig.device->board_statistics().time;
  EXPECT_GT(t.answered, 55'000U) << "a hundred a second";
  EXPECT_LT(t.unanswered, 3U);
  EXPECT_EQ(t.resets, 0U);
  EXPECT_NEAR(t.drift_ppm, -20, 1) << "the board's clock is 20 ppm fast";
}

TEST(Board, isFoundAtWhicheverBaudRateItHas) {
  for (const std::uint32_t baud : {115200U, 460800U, 921600U}) {
    mock::BoardSimulatorOptions board = board_for(Duration::seconds(20));
    board.baud = baud;
    BoardRig rig(board);
    ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
        << baud << ": " << rig.device->last_error();
    ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig.pulses(30).size(), 30U);
  }
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(20));
  board.baud = 57600;
  BoardRig other(board, {}, {.baud = 57600});
  EXPECT_EQ(other.device->connect(), DeviceStatus::ok) << other.device->last_error();
}

TEST(Board, exposureFeedbackComesWithItsPulse) {
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(20));
  board.clock_ppm = 0;
  BoardRig rig(board, direct_line());
  rig.exposures = [](const mock::SimulatedPulse& p) {
    mock::SimulatedExposures e;
    e[0] = {true, p.edge + Duration::microseconds(35), p.edge + Duration::microseconds(8035)};
    e[1] = {p.number % 5 != 3, p.edge + Duration::microseconds(41),
            p.edge + Duration::microseconds(6041 + p.number)};
    return e;
  };
  TriggerConfiguration requested = thirty_hertz();
  requested.feedback = 0x03;
  requested.feedback_active_low = 0x02;
  ASSERT_EQ(rig.device->configure(requested, nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  ASSERT_GT(all.size(), 500U);
  expect_gapless(all);
  const auto near_us = [](Duration d, std::int64_t us) {
    return std::abs(d.ns() - us * 1000) <= 1000;
  };  // a tick
  for (const Pulse& p : all) {
    ASSERT_TRUE(p.exposure[0].seen);
    ASSERT_TRUE(near_us(p.exposure[0].start, 35) && near_us(p.exposure[0].end, 8035)) << p.number;
    ASSERT_EQ(p.exposure[1].seen, p.number % 5 != 3);
    if (p.exposure[1].seen) {
      ASSERT_TRUE(near_us(p.exposure[1].start, 41) &&
                  near_us(p.exposure[1].end, 6041 + static_cast<std::int64_t>(p.number)));
    }
    ASSERT_FALSE(p.exposure[2].seen);
    ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns());
  }
}

TEST(Board, variedIntervalsAreThoseThatBothSidesKnow) {
  BoardRig rig(board_for(Duration::seconds(10)), direct_line());
  TriggerConfiguration requested = thirty_hertz();
  requested.vary = Duration::milliseconds(2);
  ASSERT_EQ(rig.device->configure(requested, nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  ASSERT_GT(all.size(), 250U);
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double expected =
        1.0 / 30 +
        (trigger_interval_is_longer(static_cast<std::uint32_t>(all[i - 1].number)) ? 2e-3 : -2e-3);
    ASSERT_NEAR((all[i].edge - all[i - 1].edge).to_seconds(), expected, 2.5e-6);
  }
}

TEST(Board, aPauseIsAGapWithoutLoss) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line());
  ASSERT_EQ(rig.device->pause(4), DeviceStatus::stopped);
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  auto all = rig.pulses(50);
  ASSERT_EQ(rig.device->pause(4), DeviceStatus::ok);
  // The thread may be as far ahead of us as its ring holds, which is eight seconds.
  const auto rest = rig.pulses();
  all.insert(all.end(), rest.begin(), rest.end());
  int gaps = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const std::uint64_t step = all[i].number - all[i - 1].number;
    if (step == 1) {
      ASSERT_FALSE(all[i].resumed);
      continue;
    }
    ++gaps;
    EXPECT_EQ(step, 5U);
    EXPECT_TRUE(all[i].resumed);
    EXPECT_NEAR((all[i].edge - all[i - 1].edge).to_seconds(), 5.0 / 30, 1e-4);
  }
  EXPECT_EQ(gaps, 1);
  EXPECT_EQ(rig.device->statistics().lost, 0U);
  EXPECT_EQ(rig.device->board_statistics().pulses.left_out, 4U);
}

TEST(Board, aRebootIsANewBootAndTheBoardGoesOnByItself) {
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(40));
  for (int i = 0; i < 20; ++i)
    board.reboots.push_back(at_s(10 + i + 0.000'137 * i));  // at any byte of any frame
  BoardRig rig(board, direct_line());
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 0) << "it answers all the while";
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
  for (const Pulse& p : all) ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns());
  EXPECT_EQ(rig.device->statistics().reboots, 20U);
  EXPECT_EQ(rig.device->board_statistics().time.resets, 0U)
      << "another boot's clock is another clock, not one that was set";
}

TEST(Board, pulsesGoOnWhileTheLineIsAwayAndWhatWasMissedIsCounted) {
  mock::SimulatedLineOptions line = direct_line();
  line.outages = {{at_s(10), at_s(12.5)}};
  BoardRig rig(board_for(Duration::seconds(20)), line);
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 1);
  std::uint64_t missed = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    ASSERT_GT(all[i].number, all[i - 1].number);
    ASSERT_EQ(all[i].boot, all[0].boot);
    missed += all[i].number - all[i - 1].number - 1;
    ASSERT_LE(std::abs((all[i].host - rig.truth(all[i])).ns()), all[i].host_error.ns());
  }
  EXPECT_GE(missed, 74U);
  EXPECT_LE(missed, 110U) << "attempts to open are half a second apart";
  const TriggerStatistics s = rig.device->statistics();
  EXPECT_EQ(s.lost, missed);
  EXPECT_EQ(s.reboots, 0U);
}

TEST(Board, oneThatLostItsSupplyTooBeginsAnew) {
  mock::SimulatedLineOptions line;
  line.outages = {{at_s(10), at_s(12), false}, {at_s(15), at_s(15.2), false}};
  BoardRig rig(board_for(Duration::seconds(20)), line);
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 2);
  EXPECT_EQ(rig.device->statistics().reboots, 2U);
  EXPECT_GT(rig.truth(all.back()), at_s(19.8));
  for (const Pulse& p : all) ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns());
}

TEST(Board, startsAfterAStopWhileItWasGone) {
  mock::SimulatedLineOptions line;
  line.outages = {{at_s(10), at_s(12)}};
  BoardRig rig(board_for(Duration::seconds(60)), line);
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  Pulse p;
  DeviceStatus s = DeviceStatus::ok;
  while (s == DeviceStatus::ok) s = rig.device->wait(Duration::seconds(20), &p);
  ASSERT_EQ(s, DeviceStatus::gone);
  EXPECT_GE(p.arrival, at_s(10));
  rig.device->stop();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(rig.pulses(100).size(), 100U);
}

TEST(Board, stopsAndStartsAgainAndNumbersGoOn) {
  BoardRig rig(board_for(Duration::seconds(200)), direct_line());
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  std::uint64_t next = 0;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
    EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::ok) << "twice does nothing";
    const auto all = rig.pulses(20);
    ASSERT_EQ(all.size(), 20U);
    EXPECT_GE(all.front().number, next);
    EXPECT_TRUE(all.front().resumed);
    expect_gapless(all);
    next = all.back().number + 1;
    rig.device->stop();
    rig.device->stop();
    const std::uint64_t made = rig.simulator->pulses_made();
    (void)rig.place->pass(Duration::seconds(1));
    EXPECT_EQ(rig.simulator->pulses_made(), made) << "no pulse after it has stopped";
    Pulse p;
    EXPECT_EQ(rig.device->wait(Duration{}, &p), DeviceStatus::stopped);
  }
  EXPECT_EQ(rig.device->statistics().starts, 3U);
  EXPECT_EQ(rig.device->statistics().lost, 0U);
  EXPECT_EQ(rig.device->statistics().pulses, rig.simulator->pulses_made());
}

TEST(Board, theReportThatAStopLeavesBehindIsNotLost) {
  BoardRig rig(board_for(Duration::seconds(200)), direct_line());
  rig.exposures = [](const mock::SimulatedPulse& p) {
    mock::SimulatedExposures e;
    e[0] = {true, p.edge + Duration::microseconds(35), p.edge + Duration::milliseconds(30)};
    return e;
  };
  TriggerConfiguration requested = thirty_hertz();
  requested.feedback = 0x01;
  ASSERT_EQ(rig.device->configure(requested, nullptr), DeviceStatus::ok);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
    const auto all = rig.pulses(3);
    ASSERT_EQ(all.size(), 3U);
    expect_gapless(all);
    rig.device->stop();
  }
  EXPECT_EQ(rig.device->statistics().lost, 0U);
}

TEST(Board, oneThatRanBeforeTheProgramIsStoppedFirst) {
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
  const auto all = rig.pulses(30);
  ASSERT_EQ(all.size(), 30U);
  EXPECT_EQ(all.front().number, made);
  EXPECT_EQ(rig.device->statistics().lost, 0U) << "those were not ours";
}

TEST(Board, oneThatStopsByItselfIsStartedAgain) {
  std::shared_ptr<mock::BoardSimulator> simulator;
  bool done = false;
  BoardRig rig(board_for(Duration::seconds(20)), direct_line(), {},
               [&](HostStamp at, std::vector<std::uint8_t>*) {
                 if (done || at < at_s(6)) return;
                 done = true;
                 simulator->receive(closed({trigger_stop, 9, 0, {}}), at);
               });
  simulator = rig.simulator;
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  expect_gapless(all);
  EXPECT_GT(rig.truth(all.back()), at_s(19.8));
  EXPECT_EQ(rig.device->board_statistics().restarts, 1U);
  EXPECT_EQ(rig.device->statistics().reboots, 0U);
}

TEST(Board, secondsOfPpsAndTheInsAreCountedAndTheTicksLocked) {
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(60));
  board.pps = true;
  board.clock_ppm = 30;
  board.ins_interval = Duration::milliseconds(40);
  BoardRig rig(board, direct_line(), {.pps = Edge::rising, .ins = Edge::falling});
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  const BoardStatistics s = rig.device->board_statistics();
  EXPECT_NEAR(static_cast<double>(s.pps_edges), 59, 1);
  EXPECT_NEAR(static_cast<double>(s.ins_edges), 1490, 15);
  EXPECT_TRUE(s.time.pps_locked);
  EXPECT_LE(s.time.pps_age, Duration::seconds(2));
  EXPECT_NEAR(s.time.drift_ppm, 0, 1)
      << "disciplined: as fast as the host's clock, which is the GNSS' here";
  for (const Pulse& p : all)
    ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns()) << p.number;
}

TEST(Board, anotherOneInItsPlaceIsNotTaken) {
  bool other = false;
  BoardRig rig(
      board_for(Duration::seconds(60)),
      [] {
        mock::SimulatedLineOptions line;
        line.outages = {{at_s(10), at_s(11)}, {at_s(20), at_s(21)}};
        return line;
      }(),
      {},
      [&](HostStamp at, std::vector<std::uint8_t>* bytes) {
        other = at > at_s(10) && at < at_s(20);
        TriggerFrame f = opened(*bytes);
        if (!other || f.type != trigger_info) return;
        f.payload[27] ^= 1U;  // of the serial number
        *bytes = closed(f);
      });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 1) << "gone while the other is there";
  for (const Pulse& p : all) EXPECT_FALSE(rig.truth(p) > at_s(10.5) && rig.truth(p) < at_s(20));
  EXPECT_GT(rig.truth(all.back()), at_s(59));
}

TEST(Board, oneThatRefusesItsConfigurationIsOpenedTwiceASecond) {
  // It has begun anew, and does not take its configuration for five seconds.
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(20));
  board.reboots = {at_s(5)};
  std::uint8_t configuring = 0;
  int refused = 0;
  BoardRig rig(board, direct_line(), {}, [&](HostStamp at, std::vector<std::uint8_t>* bytes) {
    TriggerFrame f = opened(*bytes);
    if (f.type != trigger_status || f.sequence != configuring || at < at_s(5) || at > at_s(10))
      return;
    ++refused;
    const TriggerError error{trigger_config, trigger_error_line};
    f.type = trigger_error;
    f.size = trigger_error_payload_size;
    trigger_put_error(&error, f.payload);
    *bytes = closed(f);
  });
  rig.between->lose([&](HostStamp, std::span<const std::uint8_t> bytes) {
    const TriggerFrame f = opened({bytes.begin(), bytes.end()});
    if (f.type == trigger_config) configuring = f.sequence;
    return false;
  });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 1);
  EXPECT_GE(refused, 8);
  EXPECT_LE(refused, 11);
  EXPECT_GT(rig.truth(all.back()), at_s(19));
}

// ---- what is asked

struct Refusal {
  const char* name;
  void (*change)(TriggerConfiguration*);
  DeviceStatus status;
  const char* word;
};
class Refused : public ::testing::TestWithParam<Refusal> {};

TEST_P(Refused, withTheKeyToChange) {
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(100));
  board.lines = 2;
  board.feedback_inputs = 1;
  BoardRig rig(board);
  TriggerConfiguration requested = thirty_hertz();
  GetParam().change(&requested);
  EXPECT_EQ(rig.device->configure(requested, nullptr), GetParam().status);
  EXPECT_NE(rig.device->last_error().find(GetParam().word), std::string::npos)
      << rig.device->last_error();
  EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::bad_configuration);
  EXPECT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << "and it can still be set otherwise";
  EXPECT_TRUE(rig.device->last_error().empty());
}

INSTANTIATE_TEST_SUITE_P(
    Configuration, Refused,
    ::testing::Values(
        Refusal{"noRate", [](TriggerConfiguration* c) { c->rate_hz = 0; },
                DeviceStatus::bad_configuration, "trigger.rate"},
        Refusal{"notANumber", [](TriggerConfiguration* c) { c->rate_hz = NAN; },
                DeviceStatus::bad_configuration, "trigger.rate"},
        Refusal{"fasterThanItsTimer", [](TriggerConfiguration* c) { c->rate_hz = 1500; },
                DeviceStatus::unsupported, "trigger.rate"},
        Refusal{"noWidth", [](TriggerConfiguration* c) { c->width = {}; },
                DeviceStatus::bad_configuration, "trigger.width_us"},
        Refusal{"longerThanASecond",
                [](TriggerConfiguration* c) {
                  c->rate_hz = 0.1;
                  c->width = Duration::seconds(2);
                },
                DeviceStatus::bad_configuration, "trigger.width_us"},
        Refusal{"longerThanThePeriod",
                [](TriggerConfiguration* c) { c->width = Duration::milliseconds(40); },
                DeviceStatus::bad_configuration, "trigger.width_us"},
        Refusal{"variedByAll",
                [](TriggerConfiguration* c) { c->vary = Duration::milliseconds(34); },
                DeviceStatus::bad_configuration, "trigger.vary_us"},
        Refusal{"noLine", [](TriggerConfiguration* c) { c->lines = 0; },
                DeviceStatus::bad_configuration, "trigger.lines"},
        Refusal{"aLineThatIsNot", [](TriggerConfiguration* c) { c->lines = 0x05; },
                DeviceStatus::unsupported, "trigger.lines"},
        Refusal{"anInputThatIsNot", [](TriggerConfiguration* c) { c->feedback = 0x03; },
                DeviceStatus::unsupported, "trigger.feedback"}),
    [](const auto& one) { return one.param.name; });

TEST(Configuration, inputsThatTheBoardHasNotAreRefused) {
  mock::BoardSimulatorOptions board = board_for(Duration::seconds(100));
  board.has_pps = board.has_ins = false;
  BoardRig pps(board, {}, {.pps = Edge::rising});
  EXPECT_EQ(pps.device->configure(thirty_hertz(), nullptr), DeviceStatus::unsupported);
  EXPECT_NE(pps.device->last_error().find("trigger.pps"), std::string::npos);
  BoardRig ins(board, {}, {.ins = Edge::rising});
  EXPECT_EQ(ins.device->configure(thirty_hertz(), nullptr), DeviceStatus::unsupported);
  EXPECT_NE(ins.device->last_error().find("trigger.ins"), std::string::npos);
}

TEST(Configuration, aRateBetweenThousandthsIsRemarkedOn) {
  BoardRig rig(board_for(Duration::seconds(100)));
  TriggerConfiguration requested = thirty_hertz(), actual;
  requested.rate_hz = 1000.0 / 33;
  ASSERT_EQ(rig.device->configure(requested, &actual), DeviceStatus::ok);
  EXPECT_EQ(actual.rate_hz, 30.303);
  EXPECT_NE(rig.device->remark().find("30.303"), std::string::npos) << rig.device->remark();
}

}  // namespace
}  // namespace vergence::trigger_board
