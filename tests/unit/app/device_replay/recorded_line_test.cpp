#include "app/device_replay/recorded_line.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace vergence::app {
namespace {

using Kind = LineEvent::Kind;
constexpr Duration kMs = Duration::milliseconds(1);

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// A record, a step a call; times in ms.
struct Record {
  LineRecord line;
  Record& opened(int ms, const std::string& port = "/dev/ttyUSB0") {
    line.add({Kind::opened, at(ms), 16'000, bytes_of(port)});
    return *this;
  }
  Record& read(int ms, const std::string& text) {
    line.add({Kind::read, at(ms), 0, bytes_of(text)});
    return *this;
  }
  Record& written(int ms, const std::string& text) {
    line.add({Kind::written, at(ms), 0, bytes_of(text)});
    return *this;
  }
  Record& baud(int ms, std::uint32_t value) {
    line.add({Kind::baud, at(ms), value, {}});
    return *this;
  }
  Record& timeout(int ms) {
    line.add({Kind::timeout, at(ms), 0, {}});
    return *this;
  }
  Record& lost(int ms, DeviceStatus status) {
    line.add({Kind::lost, at(ms), static_cast<std::uint32_t>(status), {}});
    return *this;
  }
  static HostStamp at(int ms) { return HostStamp{} + kMs * ms; }
};

/// The place of a record, with a line open.
struct Player {
  explicit Player(const Record& record) : place(record.line) { open(); }
  void open() {
    DeviceStatus status = DeviceStatus::failed;
    line = place.open({}, &status);
    ASSERT_EQ(status, DeviceStatus::ok);
  }
  LineRead read(int limit_ms) { return line->read(buffer, kMs * limit_ms); }
  [[nodiscard]] std::string text(const LineRead& r) const {
    return {reinterpret_cast<const char*>(buffer.data()), r.size};
  }
  RecordedPlace place;
  std::unique_ptr<ByteLine> line;
  std::array<std::uint8_t, 64> buffer{};
};

TEST(RecordedLine, aReadBringsWhatItBroughtThenWhateverItsLimit) {
  const Record record = Record().opened(5).read(10, "abc").timeout(210).read(1400, "d");
  Player p(record);
  EXPECT_EQ(p.place.name(), "/dev/ttyUSB0");
  EXPECT_EQ(p.place.latency_timer(), kMs * 16);
  EXPECT_EQ(p.line->now(), Record::at(5));
  const LineRead first = p.read(200);
  EXPECT_EQ(p.text(first), "abc");
  EXPECT_EQ(first.arrival, Record::at(10));
  EXPECT_EQ(p.read(200).status, DeviceStatus::timeout);
  EXPECT_EQ(p.line->now(), Record::at(210));
  EXPECT_EQ(p.read(200).arrival, Record::at(1400)) << "the thread was late then";
  EXPECT_EQ(p.read(200).status, DeviceStatus::ended);
  EXPECT_TRUE(p.place.exhausted());
  EXPECT_EQ(p.place.counters().reads, 2U);
}

TEST(RecordedLine, beforeAWriteTheClockShowsWhatItShowedThen) {
  const Record record = Record().opened(0).timeout(29).written(30, "ping").read(31, "pong");
  Player p(record);
  EXPECT_EQ(p.line->now(), Record::at(0));
  EXPECT_EQ(p.read(29).status, DeviceStatus::timeout);
  EXPECT_EQ(p.line->now(), Record::at(30));
  EXPECT_EQ(p.line->write(bytes_of("ping"), kMs), DeviceStatus::ok);
  const LineRead answer = p.read(200);
  EXPECT_EQ(p.text(answer), "pong");
  EXPECT_EQ(answer.arrival, Record::at(31));
  EXPECT_EQ(p.place.counters().writes, 1U);
  EXPECT_EQ(p.place.counters().not_made + p.place.counters().other, 0U);
}

TEST(RecordedLine, aWriteWithOtherBytesStandsForTheRecordedOne) {
  const Record record = Record().opened(0).written(30, "ping 7").read(31, "pong");
  Player p(record);
  EXPECT_EQ(p.line->write(bytes_of("ping 8"), kMs), DeviceStatus::ok);
  EXPECT_EQ(p.text(p.read(200)), "pong") << "nobody waits for the other one";
  EXPECT_EQ(p.place.counters().in_place, 1U);
  EXPECT_EQ(p.place.counters().other + p.place.counters().not_made, 0U);
}

TEST(RecordedLine, aWriteThatIsEarlyIsFoundAndOneThatIsNotMadeIsPassedOver) {
  const Record record = Record()
                            .opened(0)
                            .read(1, "a")
                            .written(2, "early")
                            .read(3, "b")
                            .written(4, "never")
                            .read(5, "c");
  Player p(record);
  EXPECT_EQ(p.line->write(bytes_of("early"), kMs), DeviceStatus::ok);
  std::string all;
  for (int i = 0; i < 20 && all.size() < 3; ++i) all += p.text(p.read(100));
  EXPECT_EQ(all, "abc");
  EXPECT_EQ(p.line->write(bytes_of("mine"), kMs), DeviceStatus::ok);
  EXPECT_EQ(p.place.counters().writes, 1U);
  EXPECT_EQ(p.place.counters().not_made, 1U);
  EXPECT_EQ(p.place.counters().other, 1U);
}

TEST(RecordedLine, aSwitchOfTheBaudRateLosesWhatWasNotRead) {
  const Record record =
      Record().opened(0).read(1, "old").baud(2, 9600).read(3, "new").lost(9, DeviceStatus::gone);
  Player p(record);
  EXPECT_EQ(p.line->set_baud(9600), DeviceStatus::ok);
  EXPECT_EQ(p.line->baud(), 9600U);
  EXPECT_EQ(p.text(p.read(100)), "new");
  EXPECT_EQ(p.read(100).status, DeviceStatus::gone);
}

TEST(RecordedLine, aLineThatWasOpenedAgainIsGoneUntilTheDriverOpensIt) {
  const Record record = Record().opened(0).read(1, "a").opened(700).read(701, "b");
  Player p(record);
  EXPECT_EQ(p.text(p.read(200)), "a");
  EXPECT_EQ(p.read(200).status, DeviceStatus::gone);
  p.open();
  EXPECT_EQ(p.line->now(), Record::at(700));
  EXPECT_EQ(p.text(p.read(200)), "b");
}

TEST(RecordedLine, bytesOfOneReadMayBeTakenByTwo) {
  const Record record = Record().opened(0).read(1, std::string(100, 'x'));
  Player p(record);
  EXPECT_EQ(p.read(100).size, 64U);
  EXPECT_EQ(p.read(100).size, 36U);
}

TEST(RecordedLine, anEmptyRecordHasEnded) {
  const Record record;
  Player p(record);
  EXPECT_EQ(p.read(100).status, DeviceStatus::ended);
  p.line->wake();
  EXPECT_EQ(p.read(100).status, DeviceStatus::stopped);
}

}  // namespace
}  // namespace vergence::app
