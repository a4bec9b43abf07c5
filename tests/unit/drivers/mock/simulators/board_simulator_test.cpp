#include "drivers/mock/simulators/board_simulator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vergence::mock {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Talks to the board directly, without a line.
class Bench {
 public:
  explicit Bench(BoardSimulatorOptions o = {}, PulseSource pulses = {})
      : pulses_(std::move(pulses)) {
    board_ = std::make_unique<BoardSimulator>(
        [this](const SimulatedPulse& p) {
          made.push_back(p);
          return pulses_ ? pulses_(p) : SimulatedExposures{};
        },
        o);
  }
  BoardSimulator& board() { return *board_; }
  [[nodiscard]] HostStamp now() const { return now_; }
  /// Lets time pass; what was said in it.
  std::vector<TriggerFrame> run(Duration time) {
    const HostStamp until = now_ + time;
    std::vector<TriggerFrame> said;
    for (auto next = board_->next(); next && *next <= until; next = board_->next()) {
      Bytes bytes;
      now_ = std::max(*next, now_);
      board_->produce(now_, &bytes);
      for (const std::uint8_t b : bytes) {
        TriggerFrame f;
        const TriggerDecodeStatus s = trigger_decode(&decoder_, b, &f);
        if (s == trigger_frame_ready) said.push_back(f);
        broken += s != trigger_frame_ready && s != trigger_wait ? 1 : 0;
      }
    }
    now_ = until;
    return said;
  }
  std::vector<TriggerFrame> ask(std::uint8_t type, const Bytes& payload = {}) {
    Bytes frame(trigger_max_frame);
    frame.resize(trigger_write_frame(type, 5, payload.data(), payload.size(), frame.data()));
    board_->receive(frame, now_);
    return run(Duration::milliseconds(5));
  }
  /// Sets it to this rate with both cameras' feedback, PPS and SyncOut, and starts it.
  void start(std::uint32_t millihertz) {
    TriggerConfig c{};
    c.rate_millihertz = millihertz;
    c.pulse_us = 200;
    c.lines = c.feedback_inputs = 0x03;
    c.feedback_active_low = 0x02;
    c.pps_edge = c.ins_edge = trigger_edge_rising;
    Bytes payload(trigger_config_payload_size);
    trigger_put_config(&c, payload.data());
    (void)ask(trigger_config, payload);
    (void)ask(trigger_start);
  }

  std::vector<SimulatedPulse> made;
  int broken = 0;

 private:
  PulseSource pulses_;
  std::unique_ptr<BoardSimulator> board_;
  TriggerDecoder decoder_{};
  HostStamp now_{};
};

std::vector<TriggerEvent> events_of(const std::vector<TriggerFrame>& frames) {
  std::vector<TriggerEvent> events;
  for (const TriggerFrame& f : frames) {
    TriggerEvent e;
    if (f.type == trigger_event && trigger_get_event(f.payload, f.size, &e)) events.push_back(e);
  }
  return events;
}
std::size_t count_of(const std::vector<TriggerFrame>& frames, std::uint8_t type) {
  return static_cast<std::size_t>(std::count_if(
      frames.begin(), frames.end(), [type](const TriggerFrame& f) { return f.type == type; }));
}

TEST(BoardSimulator, pulsesAreAtTheTimesThatItTells) {
  BoardSimulatorOptions o;
  o.clock_ppm = 80;
  o.wander_ppm = 3;
  o.wander_period = Duration::seconds(50);
  Bench bench(o);
  (void)bench.run(Duration::milliseconds(100));
  bench.start(30'000);
  const auto events = events_of(bench.run(Duration::seconds(100)));
  ASSERT_GT(events.size(), 2990U);
  for (std::size_t i = 0; i < events.size(); ++i) {
    const SimulatedPulse& p = bench.made[i];
    ASSERT_EQ(p.number, i);
    ASSERT_EQ(events[i].pulse, i);
    ASSERT_EQ(p.lines, 0x03);
    // The crystal's own time, from its law: 80 ppm fast and the integral of a swing of 3 ppm.
    const double t = (p.edge - HostStamp{}).to_seconds(), turn = 2 * M_PI / 50;
    const double us = 1e6 * t + 80 * t + 3 * (1 - std::cos(turn * t)) / turn;
    ASSERT_NEAR(static_cast<double>(events[i].tick), us, 1.01) << i;
    if (i > 0) {
      ASSERT_NEAR(static_cast<double>(events[i].tick - events[i - 1].tick), 1e6 / 30, 1.01);
    }
  }
}

TEST(BoardSimulator, whatTheCamerasDoIsInTheEvent) {
  Bench bench({}, [](const SimulatedPulse& p) {
    SimulatedExposures e;
    e[0] = {true, p.edge + Duration::microseconds(20), p.edge + Duration::microseconds(5020)};
    e[1] = {p.number % 2 == 0, p.edge + Duration::microseconds(40),
            p.edge + Duration::microseconds(9040)};
    return e;
  });
  (void)bench.run(Duration::milliseconds(100));
  bench.start(50'000);
  const auto events = events_of(bench.run(Duration::seconds(2)));
  ASSERT_GT(events.size(), 90U);
  for (const TriggerEvent& e : events) {
    ASSERT_NEAR(e.exposure[0].start_us, 20, 1);
    ASSERT_NEAR(e.exposure[0].end_us, 5020, 1);
    if (e.pulse % 2 == 0) {
      ASSERT_NEAR(e.exposure[1].end_us, 9040, 1);
    } else {
      ASSERT_EQ(e.exposure[1].start_us, TRIGGER_NOT_SEEN);
    }
  }
}

TEST(BoardSimulator, ppsAndSyncOutComeAsWired) {
  BoardSimulatorOptions o;
  o.pps = true;
  o.pps_gaps = {{HostStamp{} + Duration::seconds(5.5), HostStamp{} + Duration::seconds(8.5)}};
  o.ins_interval = Duration::milliseconds(40);
  Bench bench(o);
  (void)bench.run(Duration::milliseconds(100));
  bench.start(30'000);
  const auto frames = bench.run(Duration::seconds(20));
  EXPECT_EQ(count_of(frames, trigger_pps), 17U) << "the seconds 1 to 20, without 6, 7 and 8";
  EXPECT_NEAR(static_cast<double>(count_of(frames, trigger_ins)), 500, 1);
  std::vector<std::uint64_t> ticks;
  for (const TriggerFrame& f : frames) {
    TriggerEdge e;
    if (f.type == trigger_pps && trigger_get_edge(f.payload, f.size, &e)) ticks.push_back(e.tick);
  }
  EXPECT_NEAR(static_cast<double>(ticks.back() - ticks[ticks.size() - 2]), 1e6, 22)
      << "a crystal of 20 ppm on its way to PPS' rate";
}

TEST(BoardSimulator, aRestartCutsWhatIsOnTheWireAndTakesAnotherBootId) {
  std::vector<std::uint32_t> ids;
  int broken = 0;
  for (int i = 0; i < 100; ++i) {
    BoardSimulatorOptions o;
    // The first report goes out when its pulse's exposures are over: the next pulse at the latest,
    // 40 ms on.
    o.reboots = {HostStamp{} + Duration::milliseconds(500) + Duration::microseconds(i * 400)};
    Bench bench(o);
    (void)bench.run(Duration::milliseconds(100));
    ids.push_back(bench.board().boot_id());
    bench.start(25'000);
    (void)bench.run(Duration::milliseconds(500));
    EXPECT_NE(bench.board().boot_id(), ids.back());
    EXPECT_EQ(bench.board().boots(), 2);
    const std::size_t made = bench.made.size();
    EXPECT_NEAR(static_cast<double>(made), 10, 2);
    const auto after = bench.run(Duration::seconds(3));
    EXPECT_EQ(bench.made.size(), made) << "it has forgotten its configuration";
    EXPECT_GE(count_of(after, trigger_status), 2U);
    broken += bench.broken;
  }
  EXPECT_GE(broken, 1) << "a report takes 0.6 ms: one of the starts was in one";
  EXPECT_LE(broken, 3);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), ids[0]), 100) << "by the seed";
}

TEST(BoardSimulator, pulsesGoOnWhileNobodyListensAndEndWithItsTime) {
  BoardSimulatorOptions o;
  o.duration = Duration::seconds(10);
  Bench bench(o);
  (void)bench.run(Duration::milliseconds(100));
  bench.start(30'000);
  (void)bench.run(Duration::seconds(60));
  EXPECT_TRUE(bench.board().ended());
  EXPECT_FALSE(bench.board().next());
  EXPECT_NEAR(static_cast<double>(bench.made.size()), 297, 1);
  EXPECT_LT(bench.made.back().edge, HostStamp{} + Duration::seconds(10));
  EXPECT_EQ(bench.board().pulses_made(), bench.made.size());
}

TEST(BoardSimulator, twoAreTheSameAndTellPingsInBetween) {
  const auto drive = [] {
    Bench bench;
    (void)bench.run(Duration::milliseconds(100));
    bench.start(30'000);
    std::vector<std::uint64_t> ticks;
    for (std::uint32_t i = 0; i < 50; ++i) {
      Bytes payload(trigger_ping_payload_size);
      const TriggerPing ping{i};
      trigger_put_ping(&ping, payload.data());
      for (const TriggerFrame& f : bench.ask(trigger_ping, payload)) {
        TriggerPong p;
        if (f.type != trigger_pong || !trigger_get_pong(f.payload, f.size, &p)) continue;
        EXPECT_EQ(p.token, i);
        EXPECT_LE(p.received, p.sent);
        ticks.push_back(p.received);
      }
    }
    return ticks;
  };
  const auto a = drive();
  EXPECT_EQ(a.size(), 50U);
  EXPECT_EQ(a, drive());
}

}  // namespace
}  // namespace vergence::mock
