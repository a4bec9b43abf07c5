#include "drivers/mock/simulators/simulated_line.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <thread>

namespace vergence::mock {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Sends so many bytes every so often, counting up; keeps what it is told.
class Counter final : public DeviceModel {
 public:
  Counter(std::size_t bytes, Duration interval, int times = 1'000'000)
      : bytes_(bytes), interval_(interval), times_(times) {}
  void receive(std::span<const std::uint8_t> bytes, HostStamp at) override {
    told.insert(told.end(), bytes.begin(), bytes.end());
    told_at = at;
  }
  std::optional<HostStamp> next() const override {
    return times_ > 0 ? std::optional(next_) : std::nullopt;
  }
  void produce(HostStamp at, std::vector<std::uint8_t>* out) override {
    for (std::size_t i = 0; i < bytes_; ++i) out->push_back(value_++);
    next_ = at + interval_;
    --times_;
  }
  std::uint32_t baud() const override { return 115200; }
  void power_cycle(HostStamp /*at*/) override { ++power_cycles; }
  bool ended() const override { return times_ <= 0; }

  Bytes told;
  HostStamp told_at{};
  int power_cycles = 0;

 private:
  std::size_t bytes_;
  Duration interval_;
  int times_;
  HostStamp next_{};
  std::uint8_t value_ = 0;
};

struct Read {
  std::size_t size;
  HostStamp arrival;
};

std::vector<Read> reads(ByteLine& line, std::size_t most, Bytes* bytes = nullptr) {
  std::vector<Read> all;
  std::array<std::uint8_t, 4096> some{};
  while (all.size() < most) {
    const LineRead r = line.read(some, Duration::seconds(1));
    if (r.status != DeviceStatus::ok) break;
    all.push_back({r.size, r.arrival});
    if (bytes != nullptr)
      bytes->insert(bytes->end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(r.size));
  }
  return all;
}

SimulatedLineOptions quiet_host() {
  SimulatedLineOptions o;
  o.late_fraction = 0;
  return o;
}

std::unique_ptr<ByteLine> opened(SimulatedPlace& place) {
  DeviceStatus status = DeviceStatus::failed;
  auto line = place.open({}, &status);
  EXPECT_EQ(status, DeviceStatus::ok);
  return line;
}

TEST(SimulatedLine, aDenseStreamComesInBurstsOfEightPacketsUnderALongTimer) {
  SimulatedPlace place(std::make_shared<Counter>(80, Duration::milliseconds(10)), quiet_host());
  const auto line = opened(place);
  Bytes bytes;
  const auto all = reads(*line, 50, &bytes);
  ASSERT_EQ(all.size(), 50U);
  for (const Read& r : all) EXPECT_EQ(r.size, 496U);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    ASSERT_EQ(bytes[i], static_cast<std::uint8_t>(i)) << "every byte, in order";
  // 8000 bytes a second: 62 ms for 496, in whole USB frames.
  EXPECT_NEAR((all.back().arrival - all.front().arrival).to_seconds() / 49, 0.062, 0.0005);
}

TEST(SimulatedLine, nothingArrivesBeforeItWasOnTheWire) {
  for (const bool converter : {true, false}) {
    SimulatedLineOptions o = quiet_host();
    o.converter = converter;
    SimulatedPlace place(std::make_shared<Counter>(1000, Duration::seconds(10), 1), o);
    const auto line = opened(place);
    std::size_t have = 0;
    for (const Read& r : reads(*line, 1000)) {
      have += r.size;
      EXPECT_GE(r.arrival.ns(), static_cast<std::int64_t>(have) * 10'000'000'000 / 115200 - 1000)
          << have;
    }
    EXPECT_EQ(have, 1000U);
  }
}

TEST(SimulatedLine, writesReachTheDeviceAfterTheirTimeOnTheWire) {
  auto device = std::make_shared<Counter>(1, Duration::seconds(1000));
  SimulatedPlace place(device, quiet_host());
  const auto line = opened(place);
  const Bytes message(115, 0x5A);
  const HostStamp before = line->now();
  ASSERT_EQ(line->write(message, {}), DeviceStatus::ok);
  std::array<std::uint8_t, 8> some{};
  (void)line->read(some, Duration::seconds(1));
  (void)line->read(some, Duration::seconds(1));
  EXPECT_EQ(device->told, message);
  EXPECT_NEAR((device->told_at - before).to_seconds(), 115 * 10 / 115200.0 + 125e-6, 1e-6);
}

TEST(SimulatedLine, anOutageKillsTheLineAndANewOneOpensAfterIt) {
  SimulatedLineOptions o = quiet_host();
  o.outages = {{HostStamp(1'000'000'000), HostStamp(3'000'000'000), false}};
  auto device = std::make_shared<Counter>(80, Duration::milliseconds(10));
  SimulatedPlace place(device, o);
  DeviceStatus status = DeviceStatus::ok;
  {
    const auto line = opened(place);
    (void)reads(*line, SIZE_MAX);
    std::array<std::uint8_t, 8> some{};
    EXPECT_EQ(line->read(some, Duration::seconds(1)).status, DeviceStatus::gone);
    EXPECT_EQ(line->write(Bytes{1}, {}), DeviceStatus::gone);
    EXPECT_EQ(line->now(), HostStamp(1'000'000'000)) << "told when it happened";
  }
  EXPECT_EQ(place.open({}, &status), nullptr);
  EXPECT_EQ(status, DeviceStatus::not_found);
  EXPECT_TRUE(place.pass(Duration::seconds(2.5)));
  EXPECT_EQ(device->power_cycles, 1);
  const auto line = opened(place);
  EXPECT_EQ(reads(*line, 5).size(), 5U);
}

}  // namespace
}  // namespace vergence::mock
