#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "app/device_replay/recorded_board.hpp"
#include "app/device_replay/recorded_line.hpp"
#include "core/math/random.hpp"
#include "drivers/mock/simulators/simulators.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {
namespace {

/// A line whose thread loses the processor right after it has looked at the clock, now and then,
/// and that loses every twentieth message.
class UnreliableLine final : public ByteLine {
 public:
  UnreliableLine(std::unique_ptr<ByteLine> line, LinePlace& place, std::uint64_t seed)
      : line_(std::move(line)), place_(place), random_(seed, 7) {}
  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    return line_->read(out, limit);
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override {
    if (random_.uniform(0, 1) < 0.05) return DeviceStatus::ok;
    return line_->write(bytes, limit);
  }
  DeviceStatus set_baud(std::uint32_t baud) noexcept override { return line_->set_baud(baud); }
  std::uint32_t baud() const noexcept override { return line_->baud(); }
  void discard_input() noexcept override { line_->discard_input(); }
  void wake() noexcept override { line_->wake(); }
  HostStamp now() const noexcept override {
    const HostStamp then = line_->now();
    if (random_.uniform(0, 1) < 0.1)
      (void)place_.pass(Duration::microseconds(static_cast<int>(random_.uniform(0, 6000))));
    return then;
  }

 private:
  std::unique_ptr<ByteLine> line_;
  LinePlace& place_;
  mutable Random random_;
};

class UnreliablePlace final : public LinePlace {
 public:
  UnreliablePlace(std::unique_ptr<LinePlace> place, std::uint64_t seed)
      : place_(std::move(place)), seed_(seed) {}
  std::unique_ptr<ByteLine> open(const LineSettings& settings, DeviceStatus* status) override {
    auto line = place_->open(settings, status);
    if (line == nullptr) return line;
    return std::make_unique<UnreliableLine>(std::move(line), *place_, seed_);
  }
  std::string name() const override { return place_->name(); }
  Duration latency_timer() const override { return place_->latency_timer(); }
  bool pass(Duration time) override { return place_->pass(time); }

 private:
  std::unique_ptr<LinePlace> place_;
  const std::uint64_t seed_;
};

class Record final : public LineObserver {
 public:
  void on_line_event(const LineEvent& event) noexcept override { line.add(event); }
  LineRecord line;
};

enum class Pauses : std::uint8_t { none, every_hundred };

/// What a board hands out from its configuration to its end.
std::vector<Pulse> pulses_of(TriggerDevice& board, LineObserver* observer, Pauses pauses) {
  TriggerConfiguration requested;
  requested.rate_hz = 30;
  requested.vary = Duration::milliseconds(4);
  EXPECT_EQ(board.configure(requested, nullptr), DeviceStatus::ok) << board.last_error();
  EXPECT_TRUE(board.observe_line(observer));
  EXPECT_EQ(board.start(nullptr), DeviceStatus::ok);
  std::vector<Pulse> pulses;
  for (Pulse p; board.wait(Duration::seconds(20), &p) == DeviceStatus::ok;) {
    pulses.push_back(p);
    if (pauses == Pauses::none || pulses.size() % 100 != 0) continue;
    // The thread is up to 256 pulses ahead of us; at the end it is no more.
    (void)board.pause(2);
    if (pulses.size() % 200 == 0) (void)board.pause(3);
  }
  board.stop();
  return pulses;
}

std::vector<Pulse> drive(std::uint64_t seed, Pauses pauses, Record* record) {
  mock::BoardSimulatorOptions options;
  options.duration = Duration::seconds(60);
  const auto board = std::make_shared<mock::BoardSimulator>(
      [](const mock::SimulatedPulse&) { return mock::SimulatedExposures{}; }, options);
  trigger_board::Device device(
      std::make_unique<UnreliablePlace>(
          std::make_unique<mock::SimulatedPlace>(board, mock::SimulatedLineOptions{}), seed),
      {});
  return pulses_of(device, record, pauses);
}

/// Asked for pauses or not: those of the drive come about.
std::vector<Pulse> replay(const Record& record, Pauses pauses, LineReplayCounters* counters) {
  auto place = std::make_unique<RecordedPlace>(record.line);
  RecordedPlace& line = *place;
  RecordedBoard board(
      std::make_unique<trigger_board::Device>(std::move(place), trigger_board::Options{}), line);
  std::vector<Pulse> pulses = pulses_of(board, nullptr, pauses);
  *counters = line.counters();
  return pulses;
}

void expect_same(const std::vector<Pulse>& again, const std::vector<Pulse>& then,
                 std::uint64_t seed) {
  ASSERT_EQ(again.size(), then.size());
  for (std::size_t i = 0; i < then.size(); ++i) {
    ASSERT_EQ(again[i].number, then[i].number) << "seed " << seed;
    ASSERT_EQ(again[i].resumed, then[i].resumed) << "seed " << seed << ", pulse " << i;
    ASSERT_TRUE(again[i].mapped);
    ASSERT_EQ(again[i].host, then[i].host) << "seed " << seed << ", pulse " << i;
    ASSERT_EQ(again[i].host_error, then[i].host_error) << "seed " << seed << ", pulse " << i;
  }
}

// A ping that was due at one look at the clock and written after another came later in a replay,
// and every one after it, too.
TEST(RecordedBoard, pulsesHaveTheSameTimesWhereTheThreadWasPreempted) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Record record;
    const std::vector<Pulse> then = drive(seed, Pauses::none, &record);
    ASSERT_GT(then.size(), 1700U);
    LineReplayCounters counters;
    expect_same(replay(record, Pauses::none, &counters), then, seed);
  }
}

// When the caller's thread asks is its own affair; in the record it stands where it was done.
TEST(RecordedBoard, pausesComeWhereTheyCameWhoeverAsks) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Record record;
    const std::vector<Pulse> then = drive(seed, Pauses::every_hundred, &record);
    std::uint64_t left_out = 0;
    for (std::size_t i = 1; i < then.size(); ++i)
      left_out += then[i].number - then[i - 1].number - 1;
    // Fourteen requests come in time, whichever way the threads run.
    ASSERT_GE(left_out, 28U);
    for (const Pauses pauses : {Pauses::none, Pauses::every_hundred}) {
      LineReplayCounters counters;
      expect_same(replay(record, pauses, &counters), then, seed);
      EXPECT_EQ(counters.not_made, 0U) << "seed " << seed;
      EXPECT_EQ(counters.in_place, 0U) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace vergence::app
