#include "drivers/xsens/decoder.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/math/random.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::xsens {
namespace {

using xbus::LocalFrame;

TEST(Frames, eastHeadingIsTheSameInEveryFrame) {
  // Forward is east: in ENU the identity, in NWU a quarter turn to the right, in NED a quarter turn
  // and upside down.
  const double h = std::sqrt(0.5);
  for (const auto& [q, frame] : {std::pair{std::array<double, 4>{1, 0, 0, 0}, LocalFrame::enu},
                                 {{h, 0, 0, -h}, LocalFrame::nwu},
                                 {{0, h, h, 0}, LocalFrame::ned}}) {
    const auto enu = enu_attitude(q, frame);
    ASSERT_TRUE(enu);
    EXPECT_NEAR(std::abs((*enu)[3]), 1, 1e-12) << static_cast<int>(frame);
  }
  EXPECT_EQ(enu_vector({1, 2, 3}, LocalFrame::enu), (xbus::Three{1, 2, 3}));
  EXPECT_EQ(enu_vector({1, 2, 3}, LocalFrame::nwu), (xbus::Three{-2, 1, 3})) << "north, west, up";
  EXPECT_EQ(enu_vector({1, 2, 3}, LocalFrame::ned), (xbus::Three{2, 1, -3})) << "north, east, down";
}

TEST(Frames, attitudeRotatesVectorsLikeVelocity) {
  // v_enu by the attitude in ENU of a body vector must be the frame's change of v by the attitude
  // in that frame.
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    std::array<double, 4> q{random.normal(), random.normal(), random.normal(), random.normal()};
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& c : q) c /= n;
    const Eigen::Vector3d body(random.normal(), random.normal(), random.normal());
    for (const LocalFrame frame : {LocalFrame::enu, LocalFrame::nwu, LocalFrame::ned}) {
      const Eigen::Vector3d local = Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * body;
      const auto expected = enu_vector({local.x(), local.y(), local.z()}, frame);
      const auto enu = *enu_attitude(q, frame);
      const Eigen::Vector3d got = Eigen::Quaterniond(enu[3], enu[0], enu[1], enu[2]) * body;
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(got[k], expected[static_cast<std::size_t>(k)], 1e-12);
    }
  }
}

TEST(Frames, invalidRotationGivesNoAttitude) {
  EXPECT_FALSE(enu_attitude({0, 0, 0, 0}, LocalFrame::enu));
  EXPECT_FALSE(enu_attitude({NAN, 0, 0, 1}, LocalFrame::enu));
}

TEST(SampleTime, continuesAcrossWrapsAndReportsARestart) {
  SampleTime day;
  EXPECT_EQ(day.next(863'999'900, {}), ClockStep::first);
  EXPECT_EQ(day.next(0, {}), ClockStep::forward);
  EXPECT_EQ(day.stamp(), DeviceStamp(864'000'000LL * 100'000));
  EXPECT_EQ(day.next(100, {}), ClockStep::forward);
  EXPECT_EQ(day.stamp(), DeviceStamp(864'000'100LL * 100'000));
  EXPECT_EQ(day.near(863'999'950), DeviceStamp(863'999'950LL * 100'000))
      << "an older one, on the other side of the wrap";

  SampleTime full;
  EXPECT_EQ(full.next(4'294'967'200U, {}), ClockStep::first);
  EXPECT_EQ(full.next(4, {}), ClockStep::forward);
  EXPECT_EQ(full.stamp(), DeviceStamp(4'294'967'300LL * 100'000));

  // The counter exceeds a day's end, so it has the full width.
  SampleTime other;
  EXPECT_EQ(other.next(863'999'950, {}), ClockStep::first);
  EXPECT_EQ(other.next(864'000'050, {}), ClockStep::forward);
  EXPECT_EQ(other.stamp(), DeviceStamp(864'000'050LL * 100'000));

  EXPECT_EQ(other.next(864'000'050, {}), ClockStep::backward) << "the same again";
  EXPECT_EQ(other.next(864'000'000, {}), ClockStep::backward) << "an older one";
  EXPECT_EQ(other.stamp(), DeviceStamp(864'000'050LL * 100'000)) << "changes nothing";
  EXPECT_EQ(other.next(5'000, Duration::seconds(2)), ClockStep::restart);
  EXPECT_EQ(other.stamp(), DeviceStamp((864'000'050LL + 20'000) * 100'000))
      << "goes on by what has passed";
  EXPECT_EQ(other.next(5'100, {}), ClockStep::forward);
}

TEST(SampleCounter, gapsAndWrapsAreResolvedByTime) {
  SampleCounter c;
  EXPECT_EQ(c.next(65'535, 0), ClockStep::first);
  EXPECT_EQ(c.next(0, 1), ClockStep::forward);
  EXPECT_EQ(c.count(), 65'536);
  EXPECT_EQ(c.next(10, 10), ClockStep::forward) << "nine are lost";
  EXPECT_EQ(c.count(), 65'546);
  EXPECT_EQ(c.next(20, 65'546), ClockStep::forward)
      << "nine minutes of silence at 120 Hz: a whole turn";
  EXPECT_EQ(c.count(), 65'546 + 65'546);
  EXPECT_EQ(c.next(30, 65'540), ClockStep::forward) << "a turn and six more than the time says";
  EXPECT_EQ(c.count(), 65'546 + 2 * 65'546);
  EXPECT_EQ(c.next(30, 1), ClockStep::backward);
  EXPECT_EQ(c.next(30'000, 5), ClockStep::restart) << "restarted";
}

/// Messages of one period behind one another on a line without a converter: each read ends with a
/// message.
TEST(ArrivalTiming, arrivalsGiveTheirLowerBoundAndDrift) {
  constexpr std::uint32_t kBaud = 115200;
  constexpr Duration kProcessing = Duration::milliseconds(2);
  ArrivalTiming timing(kBaud, kProcessing);
  Random random(9);
  std::uint64_t at = 0;
  double worst = 0;
  for (std::int64_t i = 0; i < 4000; ++i) {
    const DeviceStamp measured(i * 10'000'000);
    const double drift = 1 + 40e-6;
    const double host_ns = 5e9 + static_cast<double>(measured.ns()) * drift;
    const HostStamp truth(std::llround(host_ns));
    const std::uint64_t begin = at, end = at + 80;
    at = end;
    const auto late = static_cast<std::int64_t>(-1e6 * std::log(1 - random.uniform()));
    timing.read(end,
                truth + kProcessing + Duration::nanoseconds(xbus::wire_time_ns(80, kBaud) + late));
    timing.message(begin, end, measured);
    if (i > 2000)
      worst = std::max(worst, std::abs((timing.at(measured).host - truth).to_seconds()));
  }
  EXPECT_LT(worst, 60e-6) << "exponential lateness of 1 ms: the least of a hundred is 10 us";
  EXPECT_NEAR(timing.drift(), 40e-6, 2e-6);
}

TEST(ArrivalTiming, readEndingInsideAMessageWaitsForIt) {
  ArrivalTiming timing(115200, {});
  timing.read(50, HostStamp(1'000'000'000));
  timing.read(80, HostStamp(1'002'700'000));
  timing.message(0, 80, DeviceStamp(0));
  // Byte 50 was on the wire 4.34 ms after the sample, byte 80 6.94 ms: both say the same to 0.1 ms.
  EXPECT_NEAR(static_cast<double>(timing.at(DeviceStamp(0)).host.ns()), 1'000'000'000 - 4'340'278,
              100'000);
}

/// Captured streams through the whole decoder: what is true of a real device's time holds.
TEST(Decoder, capturesGiveReadingsInStepWithTheirClock) {
  constexpr const char* kFolder = "data/xsens_mtdata2";
  const auto folder = test::shared_data(kFolder);
  if (!folder) GTEST_SKIP() << test::shared_data_missing(kFolder);
  for (const char* set : {"1", "2", "3", "4"}) {
    const std::string bytes = test::read_file(*folder / set / "output.bin");
    Decoder decoder;
    StreamSettings settings;
    decoder.begin(settings, 115200, {});
    std::vector<InsReading> all;
    HostStamp now(1'000'000'000);
    for (std::size_t at = 0; at < bytes.size(); at += 62) {
      const std::span<const std::uint8_t> piece(
          reinterpret_cast<const std::uint8_t*>(bytes.data()) + at,
          std::min<std::size_t>(62, bytes.size() - at));
      now = now + Duration::nanoseconds(xbus::wire_time_ns(62, 115200));
      decoder.accept(piece, now);
      for (InsReading r; decoder.next(&r);) all.push_back(r);
    }
    EXPECT_EQ(decoder.line_counters().messages, 100U);
    EXPECT_EQ(decoder.counters().lost + decoder.counters().malformed + decoder.counters().restarts,
              0U)
        << set;
    EXPECT_GE(all.size(), 70U) << set
                               << ": but the receiver's, those of the start and without a place";
    for (std::size_t i = 1; i < all.size(); ++i) {
      const Duration step = all[i].measured - all[i - 1].measured;
      EXPECT_EQ(step.ns() % 10'000'000, 0) << "in steps of the sample period, the receiver's older "
                                              "stamps between them notwithstanding";
      EXPECT_GT(step, Duration{});
      EXPECT_EQ(all[i].sample.number - all[i - 1].sample.number,
                static_cast<std::uint64_t>(step.ns() / 10'000'000));
      EXPECT_EQ(all[i].quality.utc_ns - all[i - 1].quality.utc_ns, step.ns())
          << "its UTC is the same clock";
    }
    EXPECT_NEAR(all.back().sample.position.latitude_deg, 57.6794, 1e-3);
    EXPECT_NEAR(all.back().sample.position.longitude_deg, 11.8825, 1e-3);
    EXPECT_NEAR(all.back().quality.satellites, 11.5, 0.5) << set;
  }
}

TEST(Decoder, mtdataOfAnotherLengthIsRefused) {
  Decoder decoder;
  StreamSettings settings{.generation = xbus::Generation::legacy, .layout = {0x0834, 0x203}};
  decoder.begin(settings, 115200, {});
  std::vector<std::uint8_t> frame(xbus::kMaxFrame);
  const std::vector<std::uint8_t> payload(74);
  frame.resize(xbus::write_frame({xbus::kBusMaster, 0x32, payload}, frame).size);
  decoder.accept(frame, HostStamp(1));
  InsReading r;
  EXPECT_FALSE(decoder.next(&r));
  EXPECT_EQ(decoder.counters().malformed, 1U);
}

}  // namespace
}  // namespace vergence::xsens
