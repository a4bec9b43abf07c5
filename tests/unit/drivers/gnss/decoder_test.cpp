#include "drivers/gnss/decoder.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/gnss_bytes.hpp"

namespace vergence::gnss {
namespace {

using test::nmea_sentence;

std::vector<InsReading> read(Decoder* decoder, const std::string& bytes, HostStamp at,
                             bool quiet = true) {
  std::vector<InsReading> all;
  decoder->accept(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), at);
  InsReading r;
  while (decoder->next(&r)) all.push_back(r);
  if (quiet) decoder->quiet();
  while (decoder->next(&r)) all.push_back(r);
  return all;
}

std::string epoch(const std::string& time, const std::string& course = "90.0",
                  const std::string& knots = "10.0") {
  return nmea_sentence("GNRMC," + time + ",A,2729.85,S,15300.822,E," + knots + "," + course +
                       ",290224,,,A") +
         nmea_sentence("GNGGA," + time + ",2729.85,S,15300.822,E,1,9,0.9,20.5,M,39.5,M,,") +
         nmea_sentence("GNGST," + time + ",1,,,,3.0,4.0,5.0");
}

TEST(GnssDecoder, sentencesOfOneTimeAreOneReading) {
  Decoder d({Protocol::nmea, 9600, {}});
  const auto all = read(&d, epoch("012345.00"), HostStamp(5'000'000'000));
  ASSERT_EQ(all.size(), 1U);
  const InsSample& s = all[0].sample;
  EXPECT_EQ(s.fix, FixStatus::fix_3d);
  EXPECT_NEAR(s.position.latitude_deg, -27.4975, 1e-12);
  EXPECT_NEAR(s.position.height_m, 60, 1e-12);
  EXPECT_FALSE(s.attitude_valid);
  // The sentences have no vertical speed.
  EXPECT_FALSE(s.velocity_valid);
  EXPECT_EQ(s.heading_source, HeadingSource::course);
  EXPECT_NEAR(s.yaw_enu, 0, 1e-12);
  EXPECT_NEAR(s.velocity_enu[0], 5.144444, 1e-6);
  EXPECT_NEAR(s.position_sigma, 5 / std::sqrt(2.0), 1e-12);
  EXPECT_TRUE(all[0].quality.utc_valid);
  EXPECT_EQ(all[0].quality.utc_ns, 1709169825'000'000'000);
}

TEST(GnssDecoder, qualityAndHeightGiveTheFixStatus) {
  struct Case {
    const char *quality, *height;
    FixStatus fix;
  };
  for (const Case& c :
       {Case{"1", "20.5", FixStatus::fix_3d}, Case{"5", "20.5", FixStatus::fix_3d},
        Case{"9", "20.5", FixStatus::fix_3d}, Case{"1", "", FixStatus::fix_2d},
        Case{"9", "", FixStatus::fix_2d}, Case{"6", "20.5", FixStatus::dead_reckoning},
        Case{"0", "20.5", FixStatus::none}, Case{"7", "20.5", FixStatus::none},
        Case{"8", "20.5", FixStatus::none}}) {
    Decoder d({Protocol::nmea, 0, {}});
    const auto all = read(&d,
                          nmea_sentence("GPGGA,012345.00,2729.85,S,15300.822,E," +
                                        std::string(c.quality) + ",9,0.9," + c.height + ",M,,M,,"),
                          HostStamp(1'000'000'000));
    ASSERT_EQ(all.size(), 1U) << c.quality;
    EXPECT_EQ(all[0].sample.fix, c.fix) << c.quality << c.height;
  }
  // The place of a good RMC, and no height of a GGA whose check sum fails.
  std::string damaged = epoch("012345.00");
  damaged[damaged.find(",20.5,") + 1] = '9';
  Decoder d({Protocol::nmea, 0, {}});
  const auto all = read(&d, damaged, HostStamp(1'000'000'000));
  ASSERT_EQ(all.size(), 1U);
  EXPECT_NE(all[0].sample.fix, FixStatus::fix_3d);
}

TEST(GnssDecoder, headingIsHdtElseCourseWhileMoving) {
  Decoder d({Protocol::nmea, 0, {}});
  EXPECT_EQ(read(&d, epoch("012345.00", "90.0", "0.5"), HostStamp(1'000'000'000))
                .at(0)
                .sample.heading_source,
            HeadingSource::none);
  const auto all =
      read(&d, epoch("012346.00") + nmea_sentence("HEHDT,0.0,T"), HostStamp(2'000'000'000));
  ASSERT_EQ(all.size(), 1U);
  const auto third =
      read(&d, epoch("012347.00") + nmea_sentence("HEHDT,0.0,T"), HostStamp(3'000'000'000));
  ASSERT_EQ(third.size(), 1U);
  EXPECT_EQ(third[0].sample.heading_source, HeadingSource::heading);
  EXPECT_NEAR(third[0].sample.yaw_enu, 1.5707963, 1e-6);
  EXPECT_EQ(d.best_heading(), HeadingSource::heading);
}

// Known epochs are finished by their last sentence: nothing waits for the line to go quiet.
TEST(GnssDecoder, laterEpochsAreDeliveredAtOnce) {
  Decoder d({Protocol::nmea, 0, {}});
  ASSERT_EQ(read(&d, epoch("012345.00"), HostStamp(1'000'000'000)).size(), 1U);
  EXPECT_EQ(read(&d, epoch("012346.00"), HostStamp(2'000'000'000), false).size(), 1U);
}

TEST(GnssDecoder, timeContinuesAcrossMidnight) {
  Decoder d({Protocol::nmea, 0, {}});
  const auto gga = [](const std::string& time) {
    return nmea_sentence("GPGGA," + time + ",2729.85,S,15300.822,E,1,9,0.9,20.5,M,39.5,M,,");
  };
  const auto a = read(&d, gga("235959.50"), HostStamp(1'000'000'000));
  const auto b = read(&d, gga("000000.00"), HostStamp(1'500'000'000));
  ASSERT_EQ(a.size() + b.size(), 2U);
  EXPECT_EQ(b[0].measured - a[0].measured, Duration::milliseconds(500));
  // No date was ever sent.
  EXPECT_FALSE(b[0].quality.utc_valid);
}

// Arrivals 30 to 90 ms late at 10 Hz: the stamps settle at the least delay, which `processing`
// states.
TEST(GnssDecoder, stampsAreThoseOfTheFix) {
  Decoder d({Protocol::ubx, 0, Duration::milliseconds(30)});
  const std::int64_t utc0 = 1709169825'000'000'000;
  double worst = 0;
  for (int i = 0; i < 400; ++i) {
    test::PvtBytes pvt;
    pvt.put(10, 1, 45 + (i / 10) % 15), pvt.put(9, 1, 23 + i / 150);
    // From second 45 of a minute on, fifteen seconds a minute: gaps of 45 s are part of the test.
    pvt.put(16, 4, i % 10 * 100'000'000);
    const std::int64_t seconds = (i / 10) % 15 + i / 150 * 60;
    const std::int64_t since = seconds * 1'000'000'000 + i % 10 * 100'000'000;
    const HostStamp truth(7'000'000'000 + since);
    const Duration late = Duration::milliseconds(30 + (i * 37) % 61);
    const auto all = read(&d, pvt.frame(), truth + late);
    if (all.empty()) continue;
    ASSERT_EQ(all[0].measured.ns(), utc0 + since);
    if (i > 100) worst = std::max(worst, std::abs((all[0].host - truth).to_seconds()));
  }
  // The minimum of 61 evenly spread delays comes once in 61 samples.
  EXPECT_LT(worst, 2e-3);
  EXPECT_EQ(d.counters().malformed, 0U);
}

// A receiver's own clock is tenths of a second off after a night; its first fix sets it.
TEST(GnssDecoder, timeBeforeTheFirstFixIsIgnored) {
  for (const int ahead_ms : {150, 400}) {
    Decoder d({Protocol::ubx, 0, Duration::milliseconds(30)});
    int fixed = 0;
    for (int i = 0; i < 600; ++i) {
      const bool fix = i >= 300;
      const std::int64_t since = i * 100'000'000LL,
                         reported = since + (fix ? 0 : ahead_ms * 1'000'000LL);
      test::PvtBytes pvt;
      pvt.put(9, 1, 23 + reported / 60'000'000'000);
      pvt.put(10, 1, reported / 1'000'000'000 % 60);
      pvt.put(16, 4, reported % 1'000'000'000);
      if (!fix) pvt.put(20, 1, 0), pvt.put(21, 1, 0);
      const HostStamp truth(7'000'000'000 + since);
      const auto all = read(&d, pvt.frame(), truth + Duration::milliseconds(30 + (i * 37) % 61));
      if (!fix || all.empty()) continue;
      ++fixed;
      EXPECT_EQ(all[0].sample.fix, FixStatus::fix_3d);
      EXPECT_LE(std::abs((all[0].host - truth).to_seconds()), all[0].host_error.to_seconds())
          << ahead_ms << " ms, " << i;
    }
    EXPECT_GT(fixed, 290);
  }
}

TEST(GnssDecoder, missingEpochsAreCounted) {
  Decoder d({Protocol::ubx, 0, {}});
  std::uint64_t number = 0;
  for (const int second : {10, 11, 12, 15}) {
    test::PvtBytes pvt;
    pvt.put(10, 1, second);
    const auto all = read(&d, pvt.frame(), HostStamp(second * 1'000'000'000LL));
    ASSERT_EQ(all.size(), 1U);
    number = all[0].sample.number;
  }
  EXPECT_EQ(number, 5U);
  EXPECT_EQ(d.counters().lost, 2U);
  EXPECT_EQ(d.period(), Duration::seconds(1));
}

/// Fixes of seconds 10 + … of a minute, each where it was measured.
void read_fixes(Decoder* decoder, const std::vector<int>& milliseconds) {
  for (const int ms : milliseconds) {
    test::PvtBytes pvt;
    pvt.put(10, 1, 10 + ms / 1000), pvt.put(16, 4, ms % 1000 * 1'000'000);
    (void)read(decoder, pvt.frame(), HostStamp(7'000'000'000 + ms * 1'000'000LL));
  }
}

TEST(GnssDecoder, lowerRateAfterReconnectLosesNothing) {
  Decoder d({Protocol::ubx, 0, {}});
  read_fixes(&d, {0, 100, 200, 300, 400, 500});
  EXPECT_EQ(d.period(), Duration::milliseconds(100));
  d.begin(0);
  EXPECT_EQ(d.period(), Duration{});
  read_fixes(&d, {5000, 6000, 7000, 8000});
  EXPECT_EQ(d.counters().lost, 0U);
  EXPECT_EQ(d.period(), Duration::seconds(1));
}

TEST(GnssDecoder, singleShortStepIsNoInterval) {
  Decoder d({Protocol::ubx, 0, {}});
  // A fix is acquired again 40 ms before the grid of the others goes on.
  read_fixes(&d, {0, 100, 200, 300, 960, 1000, 1100, 1200, 1300, 1400});
  EXPECT_EQ(d.period(), Duration::milliseconds(100));
  EXPECT_EQ(d.counters().lost, 6U) << "between 300 and 960 ms";
}

TEST(GnssDecoder, oldOrUntimedFixesAreNotDelivered) {
  Decoder d({Protocol::ubx, 0, {}});
  test::PvtBytes pvt;
  ASSERT_EQ(read(&d, pvt.frame(), HostStamp(1'000'000'000)).size(), 1U);
  EXPECT_EQ(read(&d, pvt.frame(), HostStamp(1'100'000'000)).size(), 0U);
  pvt.put(11, 1, 0);
  EXPECT_EQ(read(&d, pvt.frame(), HostStamp(1'200'000'000)).size(), 0U);
}

}  // namespace
}  // namespace vergence::gnss
