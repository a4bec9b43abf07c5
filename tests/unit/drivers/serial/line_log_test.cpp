#include "drivers/serial/line_log.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "drivers/serial/observed_line.hpp"
#include "drivers/serial/serial.hpp"

namespace vergence {
namespace {

using Kind = LineEvent::Kind;

/// What was said, with its bytes as text.
struct Listener final : LineObserver {
  void on_line_event(const LineEvent& e) noexcept override {
    said.emplace_back(e.kind, std::string(e.bytes.begin(), e.bytes.end()));
    values.push_back(e.value);
    times.push_back(e.time);
  }
  std::vector<std::pair<Kind, std::string>> said;
  std::vector<std::uint32_t> values;
  std::vector<HostStamp> times;
};

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

struct Somewhere final : LinePlace {
  std::unique_ptr<ByteLine> open(const LineSettings& /*settings*/,
                                 DeviceStatus* /*status*/) override {
    return nullptr;
  }
  [[nodiscard]] std::string name() const override { return "no such port"; }
  [[nodiscard]] Duration latency_timer() const override { return Duration::milliseconds(16); }
};

TEST(LineLog, aSetUpIsKeptForWhoComesLater) {
  LineLog log;
  log.opened(Somewhere{}, HostStamp{});
  log.note({Kind::written, HostStamp(5), 0, bytes_of("who")});
  log.note({Kind::read, HostStamp(6), 0, bytes_of("me")});
  Listener listener;
  log.observe(&listener);
  log.note({Kind::baud, HostStamp(7), 9600, {}});
  const std::vector<std::pair<Kind, std::string>> expected{
      {Kind::opened, "no such port"}, {Kind::written, "who"}, {Kind::read, "me"}, {Kind::baud, ""}};
  EXPECT_EQ(listener.said, expected);
  EXPECT_EQ(listener.values[0], 16'000U);
  EXPECT_EQ(listener.values[3], 9600U);
  EXPECT_TRUE(log.whole());
}

TEST(LineLog, nothingIsKeptOnceTheDeviceStreams) {
  LineLog log;
  log.note({Kind::read, HostStamp(1), 0, bytes_of("set-up")});
  log.streaming();
  log.note({Kind::read, HostStamp(2), 0, bytes_of("reading")});
  Listener listener;
  log.observe(&listener);
  EXPECT_TRUE(listener.said.empty());
}

TEST(LineLog, whatItKeepsIsBounded) {
  LineLog log;
  const std::string noise(1000, '?');
  for (int i = 0; i < 1000; ++i) log.note({Kind::read, HostStamp(i), 0, bytes_of(noise)});
  EXPECT_FALSE(log.whole());
  Listener listener;
  log.observe(&listener);
  EXPECT_LE(listener.said.size() * noise.size(), LineLog::kMostBytes);
  EXPECT_GT(listener.said.size(), 10U);
}

TEST(ObservedLine, whatIsWrittenHasTheTimeThatTheDriverSawLast) {
  auto [near, far] = make_byte_pipe();
  LineLog log;
  Listener listener;
  log.observe(&listener);
  ObservedLine line(std::move(near), log);
  const HostStamp seen = line.now();
  ASSERT_EQ(line.write(bytes_of("ask"), Duration::seconds(5)), DeviceStatus::ok);
  ASSERT_EQ(far->write(bytes_of("answer"), Duration::seconds(5)), DeviceStatus::ok);
  std::vector<std::uint8_t> out(64);
  const LineRead r = line.read(out, Duration::seconds(5));
  far.reset();
  EXPECT_EQ(line.read(out, Duration::seconds(5)).status, DeviceStatus::gone);
  const std::vector<std::pair<Kind, std::string>> expected{
      {Kind::written, "ask"}, {Kind::read, "answer"}, {Kind::lost, ""}};
  ASSERT_EQ(listener.said, expected);
  EXPECT_EQ(listener.times[0], seen);
  EXPECT_EQ(listener.times[1], r.arrival);
  EXPECT_EQ(listener.values[2], static_cast<std::uint32_t>(DeviceStatus::gone));
}

}  // namespace
}  // namespace vergence
