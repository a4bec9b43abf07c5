#include "firmware_iface/ubx/ubx.hpp"

#include <gtest/gtest.h>

#include "tests/support/gnss_bytes.hpp"

namespace vergence::ubx {
namespace {

using test::PvtBytes;

TEST(Ubx, navPvtIsDecodedInSiUnits) {
  Pvt p;
  ASSERT_TRUE(decode_pvt(PvtBytes().bytes, &p));
  // The expected value is that of date -u -d '2024-02-29 01:23:45' +%s.
  EXPECT_EQ(p.utc_ns, 1709169825'000'000'000);
  EXPECT_EQ(p.fix, FixType::fix_3d);
  EXPECT_TRUE(p.fix_ok);
  EXPECT_EQ(p.satellites, 17);
  EXPECT_NEAR(p.latitude_deg, -27.4975, 1e-12);
  EXPECT_NEAR(p.longitude_deg, 153.0137, 1e-12);
  EXPECT_NEAR(p.height_m, 60, 1e-12);
  EXPECT_NEAR(p.horizontal_sigma_m, 1.414, 1e-12);
  EXPECT_NEAR(p.velocity_ned[2], -0.5, 1e-12);
  EXPECT_NEAR(p.ground_speed, 5, 1e-12);
  EXPECT_NEAR(p.course_deg, 53.1301, 1e-12);
  EXPECT_NEAR(p.position_dop, 1.2, 1e-12);
  EXPECT_FALSE(p.heading_deg);
}

TEST(Ubx, negativeNanosecondsLowerTheTime) {
  PvtBytes b;
  b.put(16, 4, -250'000'000);
  Pvt p;
  ASSERT_TRUE(decode_pvt(b.bytes, &p));
  EXPECT_EQ(p.utc_ns, 1709169824'750'000'000);
}

TEST(Ubx, invalidFieldsAreAbsentOrRefused) {
  Pvt p;
  PvtBytes b;
  // The time is not fully resolved.
  b.put(11, 1, 3);
  ASSERT_TRUE(decode_pvt(b.bytes, &p));
  EXPECT_FALSE(p.utc_ns);
  b = {};
  b.put(6, 1, 13);
  ASSERT_TRUE(decode_pvt(b.bytes, &p));
  EXPECT_FALSE(p.utc_ns);
  b = {};
  // The latitude is beyond the pole.
  b.put(28, 4, 900000001);
  EXPECT_FALSE(decode_pvt(b.bytes, &p));
  b = {};
  b.put(20, 1, 6);
  EXPECT_FALSE(decode_pvt(b.bytes, &p));
  b = {};
  b.put(21, 1, 0x21), b.put(84, 4, 9000000);
  ASSERT_TRUE(decode_pvt(b.bytes, &p));
  EXPECT_NEAR(p.heading_deg.value(), 90, 1e-12);
  // A u-blox 7 lacks this field.
  b.bytes.resize(84);
  ASSERT_TRUE(decode_pvt(b.bytes, &p));
  EXPECT_FALSE(p.heading_deg);
  b.bytes.resize(83);
  EXPECT_FALSE(decode_pvt(b.bytes, &p));
}

TEST(Ubx, frameInsideARefusedFrameIsFound) {
  const std::string good = PvtBytes().frame();
  std::string bad = good;
  bad[20] = static_cast<char>(bad[20] ^ 1);
  // A header that promises more than it has, with a whole frame inside; one that promises too much.
  const std::string bytes = std::string("\xB5\x62\x01\x07\x80\x00", 6) + good + bad +
                            std::string("\xB5\x62\x01\x07\xFF\xFF", 6) + good + good;
  for (const std::size_t piece : {1U, 7U, 100U, 1000U}) {
    FrameStream stream;
    int heard = 0;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      const std::string part = bytes.substr(at, piece);
      const std::vector<std::uint8_t> b(part.begin(), part.end());
      ASSERT_EQ(stream.accept(b), b.size());
      for (Frame f; stream.next(&f);) heard += f.is_pvt() && f.payload.size() == 92 ? 1 : 0;
    }
    EXPECT_EQ(heard, 3) << piece;
    EXPECT_GE(stream.counters().checksum_wrong, 2U);
    EXPECT_EQ(stream.counters().length_refused, 1U);
    EXPECT_EQ(stream.counters().frame_bytes + stream.counters().garbage_bytes + stream.waiting(),
              bytes.size());
  }
}

}  // namespace
}  // namespace vergence::ubx
