#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "app/device_replay/recorded_line.hpp"
#include "core/math/random.hpp"
#include "drivers/mock/simulators/simulators.hpp"
#include "drivers/trigger_board/trigger_board.hpp"

namespace vergence::app {
namespace {

/// A line whose thread loses the processor right after it has looked at the clock, now and then.
class PreemptedLine final : public ByteLine {
 public:
  PreemptedLine(std::unique_ptr<ByteLine> line, LinePlace& place, std::uint64_t seed)
      : line_(std::move(line)), place_(place), random_(seed, 7) {}
  LineRead read(std::span<std::uint8_t> out, Duration limit) noexcept override {
    return line_->read(out, limit);
  }
  DeviceStatus write(std::span<const std::uint8_t> bytes, Duration limit) noexcept override {
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

class PreemptedPlace final : public LinePlace {
 public:
  PreemptedPlace(std::unique_ptr<LinePlace> place, std::uint64_t seed)
      : place_(std::move(place)), seed_(seed) {}
  std::unique_ptr<ByteLine> open(const LineSettings& settings, DeviceStatus* status) override {
    auto line = place_->open(settings, status);
    if (line == nullptr) return line;
    return std::make_unique<PreemptedLine>(std::move(line), *place_, seed_);
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

/// What a board on that line hands out from its configuration to its end.
std::vector<Pulse> pulses_of(std::unique_ptr<LinePlace> place, LineObserver* observer) {
  trigger_board::Device board(std::move(place), {});
  TriggerConfiguration requested;
  requested.rate_hz = 30;
  requested.vary = Duration::milliseconds(4);
  EXPECT_EQ(board.configure(requested, nullptr), DeviceStatus::ok) << board.last_error();
  EXPECT_TRUE(board.observe_line(observer));
  EXPECT_EQ(board.start(nullptr), DeviceStatus::ok);
  std::vector<Pulse> pulses;
  for (Pulse p; board.wait(Duration::seconds(20), &p) == DeviceStatus::ok;) pulses.push_back(p);
  return pulses;
}

// A ping that was due at one look at the clock and written after another came later in a replay,
// and every one after it, too.
TEST(RecordedBoard, pulsesHaveTheSameTimesWhereTheThreadWasPreempted) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    mock::BoardSimulatorOptions options;
    options.duration = Duration::seconds(60);
    const auto board = std::make_shared<mock::BoardSimulator>(
        [](const mock::SimulatedPulse&) { return mock::SimulatedExposures{}; }, options);
    Record record;
    const std::vector<Pulse> then = pulses_of(
        std::make_unique<PreemptedPlace>(
            std::make_unique<mock::SimulatedPlace>(board, mock::SimulatedLineOptions{}), seed),
        &record);
    ASSERT_GT(then.size(), 1700U);
    const std::vector<Pulse> again =
        pulses_of(std::make_unique<RecordedPlace>(record.line), nullptr);
    ASSERT_EQ(again.size(), then.size());
    for (std::size_t i = 0; i < then.size(); ++i) {
      ASSERT_EQ(again[i].number, then[i].number);
      ASSERT_TRUE(again[i].mapped);
      ASSERT_EQ(again[i].host, then[i].host) << "seed " << seed << ", pulse " << i;
      ASSERT_EQ(again[i].host_error, then[i].host_error) << "seed " << seed << ", pulse " << i;
    }
  }
}

}  // namespace
}  // namespace vergence::app
