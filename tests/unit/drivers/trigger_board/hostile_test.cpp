#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tests/unit/drivers/trigger_board/rig.hpp"

namespace vergence::trigger_board {
namespace {

using test::board_for;
using test::BoardRig;
using test::closed;
using test::direct_line;
using test::opened;
using test::Tampered;
using test::thirty_hertz;
using Bytes = std::vector<std::uint8_t>;

HostStamp at_s(double s) { return HostStamp{} + Duration::seconds(s); }

/// What a rig gave after half a minute of being tampered with, from the fifth second on.
struct Outcome {
  std::vector<Pulse> pulses;
  BoardStatistics board;
  TriggerStatistics statistics;
  int times_gone = 0;
  bool stamps_right = true;
};

Outcome half_a_minute(Tampered::Tamper tamper,
                      const mock::SimulatedLineOptions& line = direct_line()) {
  BoardRig rig(board_for(Duration::seconds(30)), line, {}, [&tamper](HostStamp at, Bytes* bytes) {
    if (at > at_s(5)) tamper(at, bytes);
  });
  Outcome o;
  EXPECT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  EXPECT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  o.pulses = rig.pulses();
  o.board = rig.device->board_statistics();
  o.statistics = rig.device->statistics();
  o.times_gone = rig.times_gone;
  for (const Pulse& p : o.pulses)
    o.stamps_right = o.stamps_right && std::abs((p.host - rig.truth(p)).ns()) <= p.host_error.ns();
  return o;
}

/// Of a board that ran all the time: every number was taken or counted as lost.
void expect_all_accounted_for(const Outcome& o) {
  ASSERT_FALSE(o.pulses.empty());
  for (std::size_t i = 1; i < o.pulses.size(); ++i) {
    ASSERT_GT(o.pulses[i].number, o.pulses[i - 1].number);
    ASSERT_GT(o.pulses[i].edge, o.pulses[i - 1].edge);
    ASSERT_EQ(o.pulses[i].boot, o.pulses[0].boot);
  }
  EXPECT_EQ(o.pulses.size() + o.statistics.lost, o.pulses.back().number + 1);
  EXPECT_GT(o.pulses.back().number, 860U) << "to the end";
  EXPECT_TRUE(o.stamps_right);
  EXPECT_EQ(o.times_gone, 0);
}

TEST(Hostile, burstsOfGarbageCostTheirFrameAndTheNextAtMost) {
  Random random(3);
  std::uint64_t bursts = 0, events = 0;
  const Outcome o = half_a_minute([&](HostStamp, Bytes* bytes) {
    if (random.uniform() >= 0.01) return;
    ++bursts;
    events += opened(*bytes).type == trigger_event ? 1 : 0;
    for (std::uint8_t& b : *bytes) b = static_cast<std::uint8_t>(random.next() >> 24U);
  });
  expect_all_accounted_for(o);
  ASSERT_GT(bursts, 20U);
  EXPECT_GE(o.statistics.lost, events);
  EXPECT_LE(o.statistics.lost, events + bursts)
      << "an event that came just behind a burst goes with it";
  EXPECT_GE(o.board.line.refused(), 1U);
  EXPECT_EQ(o.statistics.malformed, o.board.line.refused());
}

TEST(Hostile, bitsThatFlipOnTheLineCostFramesAndNothingElse) {
  mock::SimulatedLineOptions line = direct_line();
  line.corrupt = 0.001;
  const Outcome o = half_a_minute([](HostStamp, Bytes*) {}, line);
  expect_all_accounted_for(o);
  EXPECT_GT(o.board.line.bad_crc + o.board.line.bad_coding, 50U);
  EXPECT_GT(o.statistics.lost, 10U);
  EXPECT_LT(o.statistics.lost, 130U) << "of 750, each of 58 bytes";
}

TEST(Hostile, bytesThatAreMissingCostTheirFrameAndTheNext) {
  Random random(5);
  std::uint64_t cuts = 0;
  const Outcome o = half_a_minute([&](HostStamp, Bytes* bytes) {
    if (random.uniform() >= 0.01) return;
    ++cuts;
    bytes->resize(random.below(static_cast<std::uint32_t>(bytes->size())));
  });
  expect_all_accounted_for(o);
  EXPECT_LE(o.statistics.lost, 2 * cuts);
}

TEST(Hostile, longRubbishBetweenFramesIsPassedOver) {
  Random random(7);
  const Outcome o = half_a_minute([&](HostStamp, Bytes* bytes) {
    if (random.uniform() >= 0.02) return;
    Bytes rubbish(random.below(3000));
    for (std::uint8_t& b : rubbish) b = static_cast<std::uint8_t>(1 + random.below(255));
    rubbish.push_back(0);
    bytes->insert(bytes->begin(), rubbish.begin(), rubbish.end());
  });
  expect_all_accounted_for(o);
  EXPECT_EQ(o.statistics.lost, 0U);
  EXPECT_GT(o.board.line.bad_length, 10U);
}

TEST(Hostile, rightFramesOfWrongTypesAndSizesAreCounted) {
  Random random(9);
  std::uint64_t strange = 0;
  const Outcome o = half_a_minute([&](HostStamp, Bytes* bytes) {
    if (random.uniform() >= 0.1) return;
    ++strange;
    TriggerFrame f{};
    f.type = std::array<std::uint8_t, 5>{0x33, 0xFF, trigger_event, trigger_pong,
                                         trigger_status}[random.below(5)];
    f.size = static_cast<std::uint8_t>(
        random.below(23));  // none has so few but ERROR and the edges, which these types are not
    for (std::uint8_t& b : f.payload) b = static_cast<std::uint8_t>(random.next() >> 24U);
    const Bytes extra = closed(f);
    bytes->insert(bytes->begin(), extra.begin(), extra.end());
  });
  expect_all_accounted_for(o);
  EXPECT_EQ(o.statistics.lost, 0U);
  EXPECT_LE(strange - o.board.frames_unknown, 1U) << "the last may still be under way";
  EXPECT_GT(o.board.frames_unknown, 100U);
}

TEST(Hostile, eventsThatNeverCameAreCountedToTheLast) {
  Random random(11);
  std::uint64_t dropped = 0, first = 0, last = 0;
  const Outcome o = half_a_minute([&](HostStamp, Bytes* bytes) {
    TriggerEvent e;
    const TriggerFrame f = opened(*bytes);
    if (f.type != trigger_event || !trigger_get_event(f.payload, f.size, &e) ||
        random.uniform() >= 0.1)
      return;
    if (dropped++ == 0) first = e.pulse;
    last = e.pulse;
    bytes->clear();
  });
  expect_all_accounted_for(o);
  ASSERT_GT(dropped, 50U);
  EXPECT_GT(last, first);
  // One that was the last of all is not missed before somebody says that there was one.
  EXPECT_GE(o.statistics.lost + 1, dropped);
  EXPECT_LE(o.statistics.lost, dropped);
}

TEST(Hostile, repeatedEventsComeOnce) {
  const Outcome o = half_a_minute([](HostStamp, Bytes* bytes) {
    if (opened(*bytes).type == trigger_event) {
      const Bytes once = *bytes;
      bytes->insert(bytes->end(), once.begin(), once.end());
    }
  });
  expect_all_accounted_for(o);
  EXPECT_GT(o.board.pulses.repeated, 700U);
  EXPECT_EQ(o.statistics.lost, 0U);
}

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

TEST(Hostile, aClockThatIsSetBackIsFoundOutAndTheDriveGoesOn) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {}, [](HostStamp at, Bytes* bytes) {
    if (at > at_s(15)) set_back(bytes, 10'000'000);
  });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 0);
  for (std::size_t i = 1; i < all.size(); ++i) ASSERT_GT(all[i].number, all[i - 1].number);
  EXPECT_GT(all.back().number, 880U);
  const BoardStatistics s = rig.device->board_statistics();
  EXPECT_EQ(s.time.resets, 1U);
  EXPECT_LE(s.pulses.backward, 2U) << "until three pings have told, 30 ms";
  EXPECT_LE(s.pulses.lost, 2U);
  for (const Pulse& p : all)
    ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns()) << p.number;
}

TEST(Hostile, singleBackwardTicksAreRefused) {
  Random random(13);
  std::uint64_t events = 0;
  const Outcome o = half_a_minute([&](HostStamp, Bytes* bytes) {
    if (random.uniform() >= 0.02) return;
    events += opened(*bytes).type == trigger_event ? 1 : 0;
    set_back(bytes, 4'000'000);
  });
  expect_all_accounted_for(o);
  EXPECT_NEAR(static_cast<double>(o.board.pulses.backward), static_cast<double>(events), 1);
  EXPECT_EQ(o.board.time.resets, 0U);
  EXPECT_GT(o.board.time.refused, 20U);
}

TEST(Hostile, aBoardWhoseNumbersStandStillIsGoneAndNamed) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {}, [](HostStamp at, Bytes* bytes) {
    TriggerFrame f = opened(*bytes);
    TriggerEvent e;
    if (at < at_s(5) || f.type != trigger_event || !trigger_get_event(f.payload, f.size, &e))
      return;
    e.pulse = 3;
    trigger_put_event(&e, f.payload);
    *bytes = closed(f);
  });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  Pulse p;
  DeviceStatus s = DeviceStatus::ok;
  while (s == DeviceStatus::ok) s = rig.device->wait(Duration::seconds(20), &p);
  EXPECT_EQ(s, DeviceStatus::gone);
  EXPECT_NE(rig.device->last_error().find("backwards"), std::string::npos)
      << rig.device->last_error();
  EXPECT_GE(rig.device->board_statistics().pulses.repeated, 8U);
}

TEST(Hostile, aBoardThatAnswersNothingAnyMoreIsGone) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {}, [](HostStamp at, Bytes* bytes) {
    if (at > at_s(10) && at < at_s(15)) std::fill(bytes->begin(), bytes->end(), std::uint8_t{0x55});
  });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 1) << "noise is silence";
  EXPECT_GT(rig.truth(all.back()), at_s(29.8));
  EXPECT_EQ(rig.device->statistics().reboots, 0U);
  EXPECT_EQ(all.size() + rig.device->statistics().lost, all.back().number + 1);
}

TEST(Hostile, ofABoardThatDoesNotPingTheArrivalsTellTheTime) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line(), {}, [](HostStamp, Bytes* bytes) {
    if (opened(*bytes).type == trigger_pong) bytes->clear();
  });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  ASSERT_GT(all.size(), 850U);
  EXPECT_EQ(rig.times_gone, 0);
  for (const Pulse& p : all)
    ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns()) << p.number;
  EXPECT_GT(rig.device->board_statistics().time.unanswered, 2000U);
}

TEST(Hostile, aPauseThatIsLostOnTheWayIsAskedForAgain) {
  BoardRig rig(board_for(Duration::seconds(30)), direct_line());
  int asked = 0;
  rig.between->lose([&](HostStamp, std::span<const std::uint8_t> bytes) {
    return opened({bytes.begin(), bytes.end()}).type == trigger_pause && ++asked < 3;
  });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  (void)rig.pulses(10);
  ASSERT_EQ(rig.device->pause(4), DeviceStatus::ok);
  (void)rig.pulses();
  EXPECT_EQ(asked, 3);
  const BoardStatistics s = rig.device->board_statistics();
  EXPECT_EQ(s.pulses.left_out, 4U);
  EXPECT_EQ(s.pulses.lost, 0U);
}

TEST(Hostile, questionsThatAreLostOnTheWayAreAskedAgain) {
  Random random(17);
  BoardRig rig(board_for(Duration::seconds(30)), direct_line());
  rig.between->lose(
      [&](HostStamp, std::span<const std::uint8_t>) { return random.uniform() < 0.3; });
  ASSERT_EQ(rig.device->configure(thirty_hertz(), nullptr), DeviceStatus::ok)
      << rig.device->last_error();
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.pulses();
  EXPECT_EQ(rig.times_gone, 0);
  ASSERT_GT(all.size(), 830U);
  for (const Pulse& p : all)
    ASSERT_LE(std::abs((p.host - rig.truth(p)).ns()), p.host_error.ns()) << p.number;
  EXPECT_EQ(rig.device->statistics().lost, 0U);
  EXPECT_GT(rig.device->board_statistics().time.unanswered, 500U);
}

// ---- who is there

/// Something else on the port: says the same every 200 ms, and answers a frame as it is told.
class Talker final : public mock::DeviceModel {
 public:
  using Answer = std::function<Bytes(const TriggerFrame&)>;
  explicit Talker(std::string says, Answer answer = {})
      : says_(std::move(says)), answer_(std::move(answer)) {}
  void receive(std::span<const std::uint8_t> bytes, HostStamp at) override {
    now_ = at;
    TriggerFrame f;
    for (const std::uint8_t b : bytes) {
      if (trigger_decode(&decoder_, b, &f) != trigger_frame_ready || !answer_) continue;
      const Bytes a = answer_(f);
      out_.insert(out_.end(), a.begin(), a.end());
    }
  }
  std::optional<HostStamp> next() const override {
    return !out_.empty()   ? std::optional(now_)
           : says_.empty() ? std::nullopt
                           : std::optional(next_);
  }
  void produce(HostStamp at, Bytes* out) override {
    out->insert(out->end(), out_.begin(), out_.end());
    out_.clear();
    if (says_.empty() || at < next_) return;
    out->insert(out->end(), says_.begin(), says_.end());
    next_ = at + Duration::milliseconds(200);
  }
  std::uint32_t baud() const override { return 921600; }
  void power_cycle(HostStamp) override {}

 private:
  std::string says_;
  Answer answer_;
  TriggerDecoder decoder_{};
  Bytes out_;
  HostStamp now_{}, next_{};
};

std::string complaint_about(std::shared_ptr<mock::DeviceModel> there, DeviceStatus* status) {
  std::string error;
  const auto device = open_on(
      std::make_unique<mock::SimulatedPlace>(std::move(there), direct_line()), {}, status, &error);
  EXPECT_EQ(device, nullptr);
  return error;
}
std::string complaint_about(const std::string& says, DeviceStatus* status) {
  return complaint_about(std::make_shared<Talker>(says), status);
}
bool has(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

TEST(AnotherMake, isNamed) {
  DeviceStatus s = DeviceStatus::ok;
  std::string text = complaint_about(
      "$GPGGA,130305.0,4717.115,N,00833.912,E,1,08,0.9,499.6,M,48.0,M,,*5B\r\n", &s);
  EXPECT_TRUE(has(text, "NMEA")) << text;
  EXPECT_EQ(s, DeviceStatus::not_found);
  EXPECT_TRUE(has(complaint_about("\xFA\xFF\x36\x03\x10\x20\x01"
                                  "\x99",
                                  &s),
                  "Xbus"));
  text = complaint_about("Booting sketch 3...\r\n", &s);
  EXPECT_TRUE(has(text, "Booting sketch 3")) << text;
  text = complaint_about("\x81\x82\x93\xA4\xB5", &s);
  EXPECT_TRUE(has(text, "no frames")) << text;
  text = complaint_about("", &s);
  EXPECT_TRUE(has(text, "nothing there answers")) << text;
  EXPECT_EQ(s, DeviceStatus::not_found);
}

TEST(AnotherVersion, isRefusedWithBothNamed) {
  // One that answers a HELLO of any version, with an INFO that has grown.
  DeviceStatus s = DeviceStatus::ok;
  std::string text = complaint_about(
      std::make_shared<Talker>("",
                               [](const TriggerFrame& f) {
                                 TriggerFrame info{trigger_info, f.sequence, 40, {}};
                                 info.payload[0] = 7;
                                 return closed(info);
                               }),
      &s);
  EXPECT_EQ(s, DeviceStatus::unsupported);
  EXPECT_TRUE(has(text, "version 7") && has(text, "version 1")) << text;
  // One that refuses every version but its own.
  text = complaint_about(
      std::make_shared<Talker>(
          "",
          [](const TriggerFrame& f) {
            if (f.payload[0] == 3) return closed({trigger_info, f.sequence, 28, {3}});
            return closed({trigger_error, f.sequence, 2, {f.type, trigger_error_version}});
          }),
      &s);
  EXPECT_EQ(s, DeviceStatus::unsupported);
  EXPECT_TRUE(has(text, "version 3") && has(text, "version 1")) << text;
  // One that refuses all that we can think of.
  text = complaint_about(
      std::make_shared<Talker>(
          "",
          [](const TriggerFrame& f) {
            return closed({trigger_error, f.sequence, 2, {f.type, trigger_error_version}});
          }),
      &s);
  EXPECT_EQ(s, DeviceStatus::unsupported);
  EXPECT_TRUE(has(text, "version 1")) << text;
}

TEST(AnotherVersion, anInfoThatIsNoneIsRefused) {
  DeviceStatus s = DeviceStatus::ok;
  const std::string text = complaint_about(
      std::make_shared<Talker>("",
                               [](const TriggerFrame& f) {
                                 return closed({trigger_info, f.sequence, 5, {1, 2, 3, 4, 5}});
                               }),
      &s);
  EXPECT_EQ(s, DeviceStatus::unsupported);
  EXPECT_TRUE(has(text, "5 bytes")) << text;
}

TEST(AStubbornBoard, thatAnswersAndDoesNothingIsNamed) {
  // STATUS for everything, always stopped and never configured.
  TriggerInfo info{};
  info.version = 1, info.lines = 2;
  const auto there = std::make_shared<Talker>("", [&](const TriggerFrame& f) {
    TriggerFrame a{trigger_status, f.sequence, trigger_status_payload_size, {}};
    if (f.type == trigger_hello) {
      a = {trigger_info, f.sequence, trigger_info_payload_size, {}};
      trigger_put_info(&info, a.payload);
    }
    return closed(a);
  });
  Device device(std::make_unique<mock::SimulatedPlace>(there, direct_line()), {});
  EXPECT_EQ(device.configure(thirty_hertz(), nullptr), DeviceStatus::failed);
  EXPECT_TRUE(has(device.last_error(), "does not do it")) << device.last_error();
}

}  // namespace
}  // namespace vergence::trigger_board
