#include "firmware_iface/nmea/nmea.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace vergence::nmea {
namespace {

std::string line(const std::string& body) {
  char sum[8];
  (void)std::snprintf(sum, sizeof(sum), "*%02X", static_cast<unsigned>(checksum(body)));
  return body + sum;
}

Sentence parsed(const std::string& body) {
  Sentence s;
  EXPECT_EQ(parse(line(body), &s), Status::ok) << body;
  return s;
}

TEST(Nmea, ggaGivesTimePositionHeightsAndQuality) {
  const Sentence s =
      parsed("GNGGA,012345.250,2729.85000,S,15300.82200,E,4,17,0.62,20.125,M,39.5,M,1.0,0000");
  EXPECT_EQ(s.type, Type::gga);
  EXPECT_EQ(s.time_of_day_ns, ((1 * 60 + 23) * 60 + 45) * 1'000'000'000LL + 250'000'000);
  // Degrees by hand: 27° 29.85′ and 153° 0.822′.
  EXPECT_NEAR(s.latitude_deg.value(), -27.4975, 1e-12);
  EXPECT_NEAR(s.longitude_deg.value(), 153.0137, 1e-12);
  EXPECT_EQ(s.altitude_m, 20.125);
  EXPECT_EQ(s.geoid_m, 39.5);
  EXPECT_EQ(s.quality, 4);
  EXPECT_EQ(s.satellites, 17);
  EXPECT_EQ(s.hdop, 0.62);
}

TEST(Nmea, rmcGivesDateSpeedAndCourse) {
  const Sentence s = parsed("GPRMC,235959,A,2729.85,S,15300.822,W,36.0,270.5,290224,,,A");
  EXPECT_EQ(s.type, Type::rmc);
  EXPECT_TRUE(s.valid);
  // The date is 2024-02-29: date -d 2024-02-29 +%s / 86400.
  EXPECT_EQ(s.days, 19782);
  EXPECT_NEAR(s.speed.value(), 18.52, 1e-12);
  EXPECT_EQ(s.course_deg, 270.5);
  EXPECT_LT(s.longitude_deg.value(), 0);
  // The first date is 2000-01-01, the second is in the century before.
  EXPECT_EQ(parsed("GPRMC,,A,,,,,,,010100,,,A").days, 10957);
  EXPECT_EQ(parsed("GPRMC,,V,,,,,,,311299,,,N").days, 10956);
}

TEST(Nmea, hdtVtgAndGstGiveTheirFields) {
  EXPECT_EQ(parsed("HEHDT,123.4,T").heading_deg, 123.4);
  EXPECT_EQ(parsed("GNVTG,10.5,T,,M,1.0,N,36.0,K,A").course_deg, 10.5);
  EXPECT_NEAR(parsed("GNVTG,10.5,T,,M,1.0,N,36.0,K,A").speed.value(), 10.0, 1e-12);
  EXPECT_EQ(parsed("GNGST,120000,1,2,1,0,0.3,0.4,0.9").altitude_sigma_m, 0.9);
}

// Absent means absent: no field is made up of nonsense.
TEST(Nmea, malformedFieldsAreAbsent) {
  for (const char* field :
       {"", "x", "1e5", "nan", "inf", "--1", "1.2.3", "-", ".", "+5", "99999999999999999999999"})
    EXPECT_FALSE(parsed(std::string("HEHDT,") + field + ",T").heading_deg) << field;
  EXPECT_FALSE(parsed("HEHDT,361,T").heading_deg);
  EXPECT_FALSE(parsed("HEHDT,12,M").heading_deg);
  for (const char* place : {"9100.0,N", "2760.0,N", "2729.8,X", "-2729.8,N", ",N", "2729.8,"})
    EXPECT_FALSE(parsed("GPGGA,120000," + std::string(place) + ",1,E,1").latitude_deg) << place;
  for (const char* time :
       {"240000", "126000", "120061", "12000", "120000.", "120000x", "120000.1234567890"})
    EXPECT_EQ(parsed("GPGGA," + std::string(time)).time_of_day_ns.has_value(),
              std::string(time) == "120000.")
        << time;
  for (const char* day : {"320124", "001324", "0101", "01012024", "00ab24"})
    EXPECT_FALSE(parsed("GPRMC,,V,,,,,,," + std::string(day)).days) << day;
}

TEST(Nmea, missingOrWrongChecksumIsRefused) {
  Sentence s;
  EXPECT_EQ(parse("HEHDT,1,T", &s), Status::no_checksum);
  EXPECT_EQ(parse("HEHDT,1,T*00", &s), Status::checksum_wrong);
  EXPECT_EQ(parse("HEHDT,1,T*0", &s), Status::malformed);
  EXPECT_EQ(parse("HEHDT,1,T*ZZ", &s), Status::malformed);
  EXPECT_EQ(parsed("PUBX,00,1").type, Type::other);
  EXPECT_EQ(parsed("XXGGAX,1").type, Type::other);
  EXPECT_EQ(parsed("").type, Type::other);
}

TEST(Nmea, streamFindsSentencesAmongNoise) {
  SentenceStream stream;
  const std::string good = "$" + line("HEHDT,90.0,T") + "\r\n";
  const std::string bytes = "\xB5garbage" + good + "$GPGGA,cut" + good + "$" +
                            std::string(500, 'a') + good + "$HEHDT,91.0,T*00\r\n" + good;
  int heard = 0;
  Sentence s;
  for (const char c : bytes) {
    if (!stream.accept(static_cast<std::uint8_t>(c), &s)) continue;
    ++heard;
    EXPECT_EQ(s.heading_deg, 90.0);
    EXPECT_EQ(stream.size(), good.size());
  }
  EXPECT_EQ(heard, 4);
  EXPECT_EQ(stream.counters().sentences, 4U);
  EXPECT_EQ(stream.counters().checksum_wrong, 1U);
  EXPECT_EQ(stream.counters().malformed, 2U);
}

}  // namespace
}  // namespace vergence::nmea
