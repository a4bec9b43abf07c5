#include "drivers/mock/simulators/xsens_simulator.hpp"

#include <gtest/gtest.h>

#include <map>

namespace vergence::mock {
namespace {

using namespace xbus;
using Bytes = std::vector<std::uint8_t>;

InsSample still(std::uint64_t number, Duration /*time*/) {
  InsSample s;
  s.number = number;
  s.fix = FixStatus::fix_3d;
  s.attitude_valid = true;
  s.position = {-27.5, 153, 60};
  return s;
}

/// Talks to the sensor directly, without a line.
class Bench {
 public:
  explicit Bench(Generation generation, XsensSimulatorOptions o = {}) {
    o.generation = generation;
    sensor_ = std::make_unique<XsensSimulator>(still, o);
    woken_ = run(Duration::milliseconds(100));
  }
  XsensSimulator& sensor() { return *sensor_; }
  /// What it said by itself in its first tenth of a second.
  const std::vector<std::pair<std::uint8_t, Bytes>>& woken() const { return woken_; }
  /// Lets time pass; what was said in it.
  std::vector<std::pair<std::uint8_t, Bytes>> run(Duration time) {
    const HostStamp until = now_ + time;
    std::vector<std::pair<std::uint8_t, Bytes>> said;
    for (auto next = sensor_->next(); next && *next <= until; next = sensor_->next()) {
      Bytes bytes;
      sensor_->produce(std::max(*next, now_), &bytes);
      now_ = std::max(*next, now_);
      for (std::span<const std::uint8_t> rest(bytes); !rest.empty();) {
        const ParsedFrame f = parse_frame(rest);
        EXPECT_EQ(f.status, FrameStatus::ok) << "it speaks in whole frames";
        if (f.status != FrameStatus::ok) break;
        said.emplace_back(f.message.id, Bytes(f.message.payload.begin(), f.message.payload.end()));
        rest = rest.subspan(f.size);
      }
    }
    now_ = until;
    return said;
  }
  std::vector<std::pair<std::uint8_t, Bytes>> ask(MessageId id, const Bytes& payload = {}) {
    Bytes frame(kMaxFrame);
    frame.resize(write_frame({kBusMaster, static_cast<std::uint8_t>(id), payload}, frame).size);
    sensor_->receive(frame, now_);
    return run(Duration::milliseconds(5));
  }

 private:
  std::unique_ptr<XsensSimulator> sensor_;
  std::vector<std::pair<std::uint8_t, Bytes>> woken_;
  HostStamp now_{};
};

TEST(XsensSimulator, wakesWaitsForTheHostAndMeasuresByItself) {
  for (const Generation g : {Generation::legacy, Generation::mark4}) {
    Bench bench(g);
    ASSERT_EQ(bench.woken().size(), 1U);
    EXPECT_EQ(bench.woken()[0].first, 0x3E) << "WakeUp";
    EXPECT_TRUE(bench.run(Duration::milliseconds(300)).empty()) << "it waits for the host";
    const auto second = bench.run(Duration::seconds(1));
    std::map<std::uint8_t, int> kinds;
    for (const auto& [id, payload] : second) ++kinds[id];
    EXPECT_GT(kinds[g == Generation::legacy ? 0x32 : 0x36], 60);
    EXPECT_EQ(kinds[0x0D], g == Generation::legacy ? 1 : 0)
        << "an MTi-G says how it is set before it measures";
  }
}

TEST(XsensSimulator, answersWhatItsGenerationKnowsAndRefusesTheRest) {
  Bench legacy(Generation::legacy, {.device_id = 0x00500123});
  ASSERT_EQ(legacy.ask(MessageId::go_to_config).back().first, 0x31);
  EXPECT_EQ(legacy.ask(MessageId::device_id_request).back(),
            (std::pair<std::uint8_t, Bytes>{0x01, {0x00, 0x50, 0x01, 0x23}}));
  EXPECT_EQ(legacy.ask(MessageId::output_configuration).back(),
            (std::pair<std::uint8_t, Bytes>{0x42, {kErrorMessageUnknown}}));
  EXPECT_EQ(legacy.ask(MessageId::period, {0x00, 0x01}).back(),
            (std::pair<std::uint8_t, Bytes>{0x42, {0x03}}));
  EXPECT_EQ(legacy.ask(MessageId::period, {0x03, 0xC0}).back().first, 0x05);
  EXPECT_EQ(legacy.ask(MessageId::period).back().second, (Bytes{0x03, 0xC0}));
  Bench newer(Generation::mark4);
  ASSERT_EQ(newer.ask(MessageId::go_to_config).back().first, 0x31);
  EXPECT_EQ(newer.ask(MessageId::output_mode).back().first, 0x42);
  EXPECT_EQ(newer.ask(MessageId::output_configuration, {0x20, 0x10, 0x00, 0x78}).back(),
            (std::pair<std::uint8_t, Bytes>{0xC1, {0x20, 0x10, 0x00, 0x64}}))
      << "120 Hz become 100";
}

TEST(XsensSimulator, refusesToMeasureMoreThanItsLineCarries) {
  Bench bench(Generation::mark4);
  ASSERT_EQ(bench.ask(MessageId::go_to_config).back().first, 0x31);
  (void)bench.ask(MessageId::output_configuration,
                  {0x20, 0x13, 0x01, 0x90, 0x40, 0x23, 0x01, 0x90});
  EXPECT_EQ(bench.ask(MessageId::go_to_measurement).back(),
            (std::pair<std::uint8_t, Bytes>{0x42, {0x29}}));
}

TEST(XsensSimulator, receiversMessagesAreOlderAndHaveTheirStampsBehindTheData) {
  XsensSimulatorOptions o;
  for (const OutputEntry e : {OutputEntry{0x1020, kEveryMessage},
                              {0x1060, kEveryMessage},
                              {0x2010, 100},
                              {0x5042, 100},
                              {0x7010, 4}})
    (void)o.outputs.add(e);
  Bench bench(Generation::mark4, o);
  (void)bench.run(Duration::seconds(1));
  std::uint32_t newest = 0;
  std::uint16_t counter = 0;
  int fixes = 0;
  bool any = false;
  for (const auto& [id, payload] : bench.run(Duration::seconds(2))) {
    if (id != 0x36) continue;
    Mtdata2 d;
    ASSERT_EQ(decode_mtdata2(payload, &d), PacketStatus::ok);
    ASSERT_TRUE(d.packet_counter && d.sample_time_fine);
    EXPECT_TRUE(!any || *d.packet_counter == static_cast<std::uint16_t>(counter + 1))
        << "counts messages of both kinds";
    if (d.gnss_pvt) {
      ++fixes;
      EXPECT_EQ(newest - *d.sample_time_fine, 500U) << "50 ms older than the sample before it";
      EXPECT_EQ(payload[0], 0x70) << "the data first";
    } else {
      EXPECT_TRUE(!any || *d.sample_time_fine - newest == 100U);
      newest = *d.sample_time_fine;
      EXPECT_EQ(payload[0], 0x10) << "the stamps first";
    }
    counter = *d.packet_counter;
    any = true;
  }
  EXPECT_EQ(fixes, 8);
}

}  // namespace
}  // namespace vergence::mock
