#include "drivers/xsens/device.hpp"

#include "tests/support/mentions.hpp"
#include "tests/support/quantile.hpp"
#include "tests/unit/drivers/xsens/rig.hpp"

namespace vergence::xsens {
namespace {

using namespace test;
using xbus::Generation;

class BothGenerations : public ::testing::TestWithParam<Generation> {
 protected:
  [[nodiscard]] static bool legacy() { return GetParam() == Generation::legacy; }
};

TEST_P(BothGenerations, isFoundConfiguredAndReadInEnu) {
  test::XsensSimulatorOptions sensor = simulated(GetParam(), 8);
  XsensRig rig(sensor);
  ASSERT_EQ(rig.device->connect(), DeviceStatus::ok) << rig.device->last_error();
  EXPECT_EQ(rig.device->identity().generation, GetParam());
  EXPECT_EQ(rig.device->info().serial, legacy() ? "00500123" : "07701234");
  EXPECT_TRUE(mentions(rig.device->info().model, "G"));
  double actual = 0;
  ASSERT_EQ(rig.device->configure(100, &actual), DeviceStatus::ok) << rig.device->last_error();
  EXPECT_EQ(actual, 100);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  const auto all = rig.readings();
  ASSERT_GT(all.size(), 500U);
  const InsStatistics statistics = rig.device->statistics();
  EXPECT_EQ(statistics.delivered, all.size());
  EXPECT_EQ(statistics.malformed + statistics.lost + statistics.overruns, 0U);
  const auto& times = rig.simulator->sample_times_ns();
  ASSERT_GE(times.size(), all.size());
  // A first sample or two may have been sent before reading began.
  const std::size_t skipped = times.size() - all.size();
  ASSERT_LE(skipped, 13U) << "two bursts of 496 bytes";
  for (std::size_t i = 0; i < all.size(); ++i) {
    const InsSample& s = all[i].sample;
    ASSERT_TRUE(all[i].mapped && s.attitude_valid && s.velocity_valid);
    ASSERT_EQ(s.number, i);
    ASSERT_EQ(s.fix, FixStatus::fix_3d);
    ASSERT_TRUE(i == 0 || all[i].measured - all[i - 1].measured == Duration::milliseconds(10));
    const InsSample truth =
        easy_drive(0, rig.simulator->host_time(times[i + skipped]) - HostStamp{});
    ASSERT_NEAR(s.position.latitude_deg, truth.position.latitude_deg, 0x1p-32);
    ASSERT_NEAR(s.position.longitude_deg, truth.position.longitude_deg, 0x1p-32);
    ASSERT_NEAR(s.position.height_m, truth.position.height_m, 0x1p-32);
    double dot = 0;
    for (std::size_t k = 0; k < 4; ++k) dot += s.q_enu_ins[k] * truth.q_enu_ins[k];
    ASSERT_NEAR(std::abs(dot), 1, 1e-12);
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(s.velocity_enu[k], truth.velocity_enu[k], 2.5e-7) << "a float's step at 2 m/s";
    ASSERT_TRUE(all[i].quality.utc_valid);
    ASSERT_EQ(all[i].quality.utc_ns, sensor.unix_ns_at_power_on + times[i + skipped]);
  }
  EXPECT_EQ(all.back().quality.filter_valid, true);
  // The receiver's data fit this rate and baud rate.
  if (!legacy()) {
    EXPECT_EQ(all.back().quality.satellites, 11);
    EXPECT_NEAR(all.back().sample.position_sigma, 1.5, 1e-3);
    EXPECT_NEAR(all.back().sample.height_sigma, 3, 1e-3);
    EXPECT_NEAR(all.back().sample.velocity_sigma, 0.1, 1e-3);
  }
}

/// Where there is more than a period between two stamps: both of them. Once only.
template <class Times, class OfTime>
std::pair<std::int64_t, std::int64_t> gap_in(const Times& times, const OfTime& ns_of) {
  std::pair<std::int64_t, std::int64_t> gap{0, 0};
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (ns_of(times[i]) - ns_of(times[i - 1]) <= 10'000'000) continue;
    EXPECT_EQ(gap.second, 0) << "a second one at " << i;
    gap = {ns_of(times[i - 1]), ns_of(times[i])};
  }
  return gap;
}

// Cameras that SyncOut triggers are paired by a gap: every pulse on either side of it has to have
// its reading, also behind a converter that keeps bytes for 16 ms.
TEST(XsensDevice, pauseLosesNoReadingAndIsMarked) {
  XsensRig rig(simulated(Generation::mark4, 30), {}, {.sync_out_hz = 25});
  ASSERT_EQ(rig.device->configure(100, nullptr), DeviceStatus::ok) << rig.device->last_error();
  EXPECT_EQ(rig.device->pause(Duration::milliseconds(200)), DeviceStatus::stopped);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  auto all = rig.readings(300);
  ASSERT_EQ(rig.device->pause(Duration::milliseconds(200)), DeviceStatus::ok);
  const auto rest = rig.readings();
  all.insert(all.end(), rest.begin(), rest.end());
  const auto made = gap_in(rig.simulator->sample_times_ns(), [](std::int64_t ns) { return ns; });
  const auto reported = gap_in(all, [](const InsReading& r) { return r.measured.ns(); });
  EXPECT_GE(made.second - made.first, 200'000'000);
  EXPECT_LT(made.second - made.first, 400'000'000);
  const std::int64_t origin = rig.simulator->sample_time_origin_ns();
  EXPECT_EQ(reported.first - origin, made.first);
  EXPECT_EQ(reported.second - origin, made.second);
  for (const InsReading& r : all) EXPECT_EQ(r.resumed, r.measured.ns() == reported.second);
  const auto marked =
      std::count_if(all.begin(), all.end(), [](const InsReading& r) { return r.quality.sync_out; });
  EXPECT_NEAR(static_cast<double>(marked), static_cast<double>(all.size()) / 4, 3);
  EXPECT_EQ(rig.disconnects, 0);
}

TEST(XsensDevice, stopEndsSyncOutPulses) {
  XsensRig rig(simulated(Generation::mark4), {}, {.sync_out_hz = 25});
  rig.start();
  (void)rig.readings(20);
  rig.device->stop();
  EXPECT_FALSE(rig.simulator->measuring());
}

TEST_P(BothGenerations, unchangedSettingsAreNotWrittenAgain) {
  XsensRig rig(simulated(GetParam()), {}, {.sync_out_hz = 25});
  ASSERT_EQ(rig.device->configure(100, nullptr), DeviceStatus::ok) << rig.device->last_error();
  const test::XsensWrites first = rig.simulator->writes();
  EXPECT_GT(first.outputs + first.layout, 0);
  EXPECT_GT(first.sync_out + first.sync_settings, 0);
  ASSERT_EQ(rig.device->configure(100, nullptr), DeviceStatus::ok) << rig.device->last_error();
  const test::XsensWrites& second = rig.simulator->writes();
  const auto asked_for = [](const test::XsensWrites& w) {
    return std::array{w.outputs, w.layout, w.period, w.skip, w.sync_out, w.sync_settings};
  };
  EXPECT_EQ(asked_for(second), asked_for(first));
  EXPECT_EQ(second.baud, 0);
  EXPECT_EQ(second.heading, 0) << "message D6 means the heading to a newer device";
}

TEST_P(BothGenerations, syncOutIsSetPerGeneration) {
  XsensRig rig(simulated(GetParam()), {}, {.sync_out_hz = 30, .sync_out_width_ms = 2});
  double actual = 0;
  ASSERT_EQ(rig.device->configure(legacy() ? 120 : 100, &actual), DeviceStatus::ok)
      << rig.device->last_error();
  if (legacy()) {
    EXPECT_EQ(rig.simulator->settings().legacy_sync_out(),
              (std::array<std::uint32_t, 4>{0x12, 3, 0, 58982}));
    EXPECT_EQ(rig.device->stream().sync_out_hz, 30);
    EXPECT_TRUE(rig.device->remark().empty()) << rig.device->remark();
  } else {
    const auto entries = rig.simulator->settings().sync_settings().items();
    ASSERT_EQ(entries.size(), 2U);
    EXPECT_EQ(entries[0].function, 14) << "the receiver's clock stays";
    EXPECT_EQ(entries[1], (xbus::SyncEntry{xbus::kSyncIntervalTransition, xbus::kSyncLineOut,
                                           xbus::kSyncPositive, 0, 0, 12, 20, 0}));
    EXPECT_NEAR(rig.device->stream().sync_out_hz, 30.77, 0.01);
    EXPECT_TRUE(mentions(rig.device->remark(), "30.77")) << "it cannot make 30 Hz, and says so";
  }
}

TEST_P(BothGenerations, otherBaudRateIsFoundAndChanged) {
  test::XsensSimulatorOptions sensor = simulated(GetParam(), 30);
  sensor.baud = 57600;
  // The baud rate can carry this layout.
  sensor.layout = {0x0004, 0x001};
  XsensRig rig(sensor, {}, {.baud = 460800});
  ASSERT_EQ(rig.device->configure(100, nullptr), DeviceStatus::ok) << rig.device->last_error();
  EXPECT_EQ(rig.simulator->baud(), 460800U);
  EXPECT_EQ(rig.simulator->writes().baud, 1);
  ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
  EXPECT_EQ(rig.readings(50).size(), 50U);
}

TEST_P(BothGenerations, slowLineIsRefusedNamingTheNeededRate) {
  XsensRig rig(simulated(GetParam()));
  ASSERT_EQ(rig.device->connect(), DeviceStatus::ok);
  EXPECT_EQ(rig.device->configure(400, nullptr), DeviceStatus::no_bandwidth);
  EXPECT_TRUE(mentions(rig.device->last_error(), "115200 baud", "ins.baud"));
  EXPECT_EQ(rig.simulator->writes().outputs + rig.simulator->writes().layout +
                rig.simulator->writes().period,
            0)
      << "nothing was changed";
  EXPECT_EQ(rig.device->configure(100, nullptr), DeviceStatus::ok)
      << "and it can still be set otherwise";
}

TEST_P(BothGenerations, lostSettingsAreWrittenAgain) {
  XsensRig rig(simulated(GetParam(), 20));
  // From 9 s on its messages hold nothing that was asked for, until it is told to stop measuring.
  bool lost = false;
  rig.between->lose([&lost](HostStamp, std::span<const std::uint8_t> bytes) {
    if (bytes.size() > 2 && bytes[2] == static_cast<std::uint8_t>(xbus::MessageId::go_to_config))
      lost = false;
    return false;
  });
  bool has_them = true;
  rig.between->tamper([&](HostStamp at, std::vector<std::uint8_t>* bytes) {
    if (at > HostStamp(9'000'000'000) && std::exchange(has_them, false)) lost = true;
    if (!lost) return;
    constexpr std::array<std::uint8_t, 5> kCounterAlone{0x10, 0x20, 2, 0, 7};
    std::array<std::uint8_t, xbus::kMaxFrame> frame{};
    const auto id = legacy() ? xbus::MessageId::mtdata : xbus::MessageId::mtdata2;
    const xbus::WrittenFrame w =
        xbus::write_frame({xbus::kBusMaster, static_cast<std::uint8_t>(id), kCounterAlone}, frame);
    bytes->assign(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(w.size));
  });
  const auto all = rig.drive();
  EXPECT_EQ(rig.disconnects, 1);
  EXPECT_GT(all.back().arrival, HostStamp(19'500'000'000));
  EXPECT_EQ(std::count_if(all.begin(), all.end(),
                          [](const InsReading& r) {
                            return r.arrival > HostStamp(9'100'000'000) &&
                                   r.arrival < HostStamp(11'000'000'000);
                          }),
            0);
}

INSTANTIATE_TEST_SUITE_P(Xsens, BothGenerations,
                         ::testing::Values(Generation::legacy, Generation::mark4),
                         [](const auto& one) {
                           return one.param == Generation::legacy ? "legacy" : "mark4";
                         });

// ---- stamps

struct Timing {
  const char* name;
  Generation generation;
  double rate;
  std::uint32_t baud;
  // 0 if there is no converter.
  int latency_ms;
};

class Stamps : public ::testing::TestWithParam<Timing> {};

TEST_P(BothGenerations, silentSensorIsToldToMeasureAgain) {
  test::XsensSimulatorOptions sensor = simulated(GetParam(), 20);
  sensor.silences = {HostStamp(9'000'000'000)};
  XsensRig rig(sensor);
  EXPECT_GT(rig.drive().back().arrival, HostStamp(19'500'000'000));
  EXPECT_EQ(rig.disconnects, 1);
}

TEST_P(Stamps, errorIsBelow300usAfterTwentySeconds) {
  const Timing& t = GetParam();
  std::vector<double> errors_us;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    test::XsensSimulatorOptions sensor = simulated(t.generation);
    sensor.baud = t.baud;
    sensor.clock_ppm = seed == 2 ? -50 : 50;
    sensor.seed = seed;
    sensor.duration = Duration::seconds(80);
    test::SimulatedLineOptions line{.converter = t.latency_ms > 0,
                                    .latency_timer = Duration::milliseconds(t.latency_ms),
                                    .seed = seed};
    XsensRig rig(sensor, line);
    ASSERT_EQ(rig.device->configure(t.rate, nullptr), DeviceStatus::ok) << rig.device->last_error();
    ASSERT_EQ(rig.device->start(nullptr), DeviceStatus::ok);
    const auto all = rig.readings();
    ASSERT_GT(all.size(), 70U * static_cast<unsigned>(t.rate));
    // The simulator's newest samples are the readings' newest: the device's clock is tied by the
    // last of both.
    const std::int64_t origin =
        t.generation == Generation::mark4
            ? rig.simulator->sample_time_origin_ns()
            : all.back().measured.ns() - rig.simulator->sample_times_ns().back();
    for (const InsReading& r : all)
      if (r.measured - all.front().measured >= Duration::seconds(20))
        errors_us.push_back(std::abs(
            (r.host - rig.simulator->host_time(r.measured.ns() - origin)).to_seconds() * 1e6));
  }
  EXPECT_LE(test::quantile(errors_us, 0.99), 300);
}

INSTANTIATE_TEST_SUITE_P(
    Lines, Stamps,
    ::testing::Values(Timing{"legacy_115200_16ms", Generation::legacy, 120, 115200, 16},
                      Timing{"mark4_115200_16ms", Generation::mark4, 100, 115200, 16},
                      Timing{"mark4_921600_16ms", Generation::mark4, 100, 921600, 16},
                      Timing{"mark4_115200_direct", Generation::mark4, 100, 115200, 0}),
    [](const auto& one) { return one.param.name; });

// ---- what is special to one of them, and what is none

TEST(Mark4, lostSampleAtOneHertzIsNoSilence) {
  XsensRig rig(simulated(Generation::mark4, 40));
  rig.between->tamper([n = 0](HostStamp at, std::vector<std::uint8_t>* bytes) mutable {
    if (at > HostStamp(9'000'000'000) && at < HostStamp(20'000'000'000) && ++n % 3 != 0)
      bytes->clear();
  });
  rig.start(1);
  EXPECT_GT(rig.readings().back().arrival, HostStamp(35'000'000'000));
  EXPECT_EQ(rig.disconnects, 0);
}

TEST(Mark4, occasionalMissingPositionKeepsTheFix) {
  test::XsensSimulatorOptions sensor = simulated(Generation::mark4, 20);
  sensor.missing_position = 0.2;
  XsensRig rig(sensor);
  const auto all = rig.drive();
  ASSERT_GT(all.size(), 1200U);
  for (const InsReading& r : all) ASSERT_EQ(r.sample.fix, FixStatus::fix_3d);
  EXPECT_LT(all.size(), 1700U);
}

TEST(Mark4, missingFixIsReportedAndReadingContinues) {
  XsensRig rig(simulated(Generation::mark4, 20), {}, {}, [](std::uint64_t n, Duration t) {
    InsSample s = easy_drive(n, t);
    if (t > Duration::seconds(8)) s.fix = FixStatus::none;
    if (t > Duration::seconds(14)) s.fix = FixStatus::dead_reckoning;
    return s;
  });
  rig.start();
  int without = 0, reckoned = 0;
  for (const InsReading& r : rig.readings()) {
    without += r.sample.fix == FixStatus::none ? 1 : 0;
    reckoned += r.sample.fix == FixStatus::dead_reckoning ? 1 : 0;
    ASSERT_TRUE(r.sample.attitude_valid);
    ASSERT_TRUE(r.sample.fix != FixStatus::none || r.sample.position_sigma == 0);
  }
  EXPECT_NEAR(without, 600, 5);
  EXPECT_NEAR(reckoned, 600, 8);
}

TEST(AnotherMake, isNamed) {
  for (const auto& [mentions, word] :
       {std::pair{"$GPGGA,130305.0,4717.115,N,00833.912,E,1,08,0.9*5B\r\n", "NMEA"},
        {"\xB5\x62\x01\x07 some more bytes", "u-blox"},
        {"hello hello hello", "not Xbus"},
        {"", "silent"}}) {
    Device device(std::make_unique<test::SimulatedLinkFactory>(
                      std::make_shared<test::Talker>(mentions, 9600), test::SimulatedLineOptions{}),
                  {});
    EXPECT_EQ(device.connect(), DeviceStatus::not_found);
    EXPECT_TRUE(test::mentions(device.last_error(), word));
  }
}

template <Generation kGeneration>
struct JoinedSensor {
  using Item = InsReading;
  static constexpr double kRate = 100;
  JoinedSensor(const test::SimulatedLineOptions& line, Duration duration,
               test::Tampered::Tamper tamper)
      : rig(simulated(kGeneration, duration.to_seconds()), line, {}, easy_drive,
            std::move(tamper)) {}
  DeviceStatus configure() { return rig.device->configure(kRate, nullptr); }
  Device& device() { return *rig.device; }
  static std::pair<std::uint64_t, DeviceStamp> order(const InsReading& r) {
    return {r.sample.number, r.measured};
  }
  XsensRig rig;
};

}  // namespace
}  // namespace vergence::xsens

namespace vergence::test {
using XsensGenerations = ::testing::Types<xsens::JoinedSensor<xbus::Generation::legacy>,
                                          xsens::JoinedSensor<xbus::Generation::mark4>>;
INSTANTIATE_TYPED_TEST_SUITE_P(Xsens, SerialConformance, XsensGenerations);
}  // namespace vergence::test
