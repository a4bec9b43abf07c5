#include "firmware_iface/xbus/mtdata2.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "firmware_iface/xbus/bytes.hpp"
#include "firmware_iface/xbus/frame.hpp"
#include "tests/unit/firmware_iface/xbus/hex.hpp"

namespace vergence::xbus {
namespace {

/// The message of one frame, decoded; its spans point into `bytes`.
Mtdata2 decoded(const std::vector<std::uint8_t>& bytes) {
  const ParsedFrame frame = parse_frame(bytes);
  EXPECT_EQ(frame.status, FrameStatus::ok);
  EXPECT_TRUE(frame.message.is(MessageId::mtdata2));
  Mtdata2 out;
  EXPECT_TRUE(decode_mtdata2(frame.message.payload, &out));
  return out;
}

TEST(Numbers, fixedPointAndFloatAreReadFromTheWire) {
  EXPECT_EQ(read_fp16_32(from_hex("80 00 00 00 FF FF")), -0.5);
  EXPECT_EQ(read_fp16_32(from_hex("00 00 00 00 00 01")), 1.0);
  EXPECT_EQ(read_fp16_32(from_hex("00 00 00 00 80 00")), -32768.0);
  EXPECT_NEAR(read_fp16_32(from_hex("86 01 47 28 FF E4")), -27.476543, 0x1p-32);
  EXPECT_NEAR(read_fp16_32(from_hex("64 A6 8A A8 00 1F")), 31.393166223541, 1e-12);
  EXPECT_EQ(read_fp12_20(from_hex("FF F8 00 00")), -0.5);
  EXPECT_EQ(read_fp12_20(from_hex("00 9D 00 00")), 9.8125);
  EXPECT_EQ(read_float64(from_hex("40 4A 20 00 00 00 00 00")), 52.25);
  EXPECT_EQ(read_i32(from_hex("FF FF FF F4")), -12);
}

TEST(Mtdata2, positionInFp1632IsDecodedExactly) {
  const Mtdata2 m =
      decoded(from_hex("FA FF 36 53 10 20 02 FF FF 10 60 04 33 7F 97 9C 20 10 10 3F 35 04 F3 00 00 "
                       "00 00 00 00 00 00 3F 35 04 F3 50 42 0C 86 01 47 28 FF E4 07 5D 24 9E 00 99 "
                       "50 22 06 40 00 00 00 00 34 D0 12 12 80 00 00 00 00 0A E0 00 00 00 FF FF 10 "
                       "00 00 00 00 00 E0 20 04 01 80 00 47 7F"));
  EXPECT_EQ(m.packet_counter, 0xFFFF);
  EXPECT_EQ(m.sample_time_fine, 863'999'900U);
  ASSERT_TRUE(m.latitude_longitude_deg && m.altitude_ellipsoid_m && m.velocity && m.quaternion);
  EXPECT_NEAR((*m.latitude_longitude_deg)[0], -27.476543, 0x1p-33);
  EXPECT_NEAR((*m.latitude_longitude_deg)[1], 153.028765, 0x1p-33);
  EXPECT_EQ(m.altitude_ellipsoid_m, 52.25);
  EXPECT_EQ((*m.velocity), (Three{10.5, -0.125, 0.0625}));
  EXPECT_EQ(m.velocity_frame, LocalFrame::enu);
  EXPECT_NEAR((*m.quaternion)[0], std::sqrt(0.5), 1e-7);
  EXPECT_EQ(m.status_word, 0x01800047U);
}

TEST(Mtdata2, packetIdGivesFormatAndFrame) {
  // The packet is in 12.20 format and NED.
  const Mtdata2 m =
      decoded(from_hex("FA FF 36 13 20 15 10 00 10 00 00 00 00 00 00 00 00 00 00 FF F8 00 00 6C"));
  ASSERT_TRUE(m.quaternion);
  EXPECT_EQ(*m.quaternion, (std::array<double, 4>{1, 0, 0, -0.5}));
  EXPECT_EQ(m.orientation_frame, LocalFrame::ned);
}

TEST(Mtdata2, gnssFixOfTheReceiverIsDecoded) {
  const Mtdata2 m =
      decoded(from_hex("FA FF 36 7C 70 10 5E 02 F5 C9 2A 07 E3 01 14 0D 2F 18 37 00 00 00 05 0E E3 "
                       "2A 24 03 01 0B 00 07 15 22 E8 22 61 2F 55 00 01 3F 71 00 00 A9 2A 00 00 08 "
                       "D3 00 00 08 18 FF FF FF E5 00 00 00 0A FF FF FF FE 00 00 00 1D 00 00 00 00 "
                       "00 00 01 5E 00 E5 51 9A 00 02 00 00 00 9A 00 8B 00 44 00 70 00 53 00 37 00 "
                       "3E 10 10 0C 0E E6 B2 80 07 E3 01 14 0D 2F 18 37 10 60 04 03 14 F2 54 10 20 "
                       "02 A9 98 08"));
  ASSERT_TRUE(m.gnss_pvt && m.utc);
  const GnssPvt& p = *m.gnss_pvt;
  EXPECT_EQ(p.satellites, 11);
  EXPECT_EQ(p.fix, 3);
  EXPECT_EQ(p.horizontal_accuracy_mm, 2259U);
  EXPECT_EQ(p.vertical_accuracy_mm, 2072U);
  EXPECT_EQ(p.speed_accuracy_mm_s, 350U);
  EXPECT_EQ(p.position_dop_1e2, 139);
  EXPECT_EQ(m.utc->nanosecond, 250'000'000U);
  EXPECT_EQ(m.utc->year, 2019);
  EXPECT_EQ(m.utc->second, 24);
  EXPECT_EQ(m.sample_time_fine, 51704404U);
  EXPECT_EQ(m.packet_counter, 43416);
}

TEST(Mtdata2, truncatedPayloadsAreRefusedWhole) {
  const std::vector<std::uint8_t> payload = from_hex("10 20 02 FF FF 10 60 04 33 7F 97 9C");
  Mtdata2 out;
  out.packet_counter = 77;
  for (std::size_t n = 0; n <= payload.size(); ++n) {
    const bool whole = n == 0 || n == 5 || n == payload.size();
    Mtdata2 at = out;
    EXPECT_EQ(decode_mtdata2(std::span(payload).first(n), &at), whole) << n;
    EXPECT_EQ(at.packet_counter == 77, !whole) << n;
  }
}

TEST(Mtdata2, packetsOfWrongSizeOrValueAreRefused) {
  struct Case {
    const char* bytes;
    const char* what;
  };
  for (const auto& [bytes, what] :
       {Case{"10 20 01 00", "a counter of one byte"}, Case{"10 60 02 00 00", "a time of two bytes"},
        Case{"20 10 0F 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00",
             "a quaternion of fifteen bytes"},
        Case{"20 10 00", "an empty quaternion"},
        Case{"20 1C 10 3F 80 00 00 00 00 00 00 00 00 00 00 00 00 00 00",
             "a frame that does not exist"},
        Case{"50 20 04 7F C0 00 00", "an altitude that is not a number"},
        Case{"50 23 08 7F F0 00 00 00 00 00 00", "an infinite altitude"},
        Case{"70 10 02 00 00", "a fix of two bytes"},
        Case{"70 20 08 00 00 00 00 01 00 00 00", "a satellite list without its satellite"},
        Case{"70 20 02 00 00", "a satellite list without its header"},
        Case{"E0 10 02 00 00", "a status byte of two"}}) {
    Mtdata2 out;
    ASSERT_TRUE(decode_mtdata2(from_hex(bytes), &out)) << what;
    EXPECT_FALSE(out.packet_counter || out.sample_time_fine || out.quaternion ||
                 out.altitude_ellipsoid_m || out.gnss_pvt || out.satellites || out.status_byte)
        << what;
  }
}

TEST(Mtdata2, packetsAreFoundBesideUnknownOnes) {
  Mtdata2 out;
  ASSERT_TRUE(decode_mtdata2(
      from_hex("88 30 03 01 02 03 10 20 02 00 07 E0 10 01 07 50 23 04 42 13 40 00 70 20 10 02 F5 "
               "C9 2A 02 00 00 00 00 05 2B 07 06 0A 1F 0F FF FF 00"),
      &out));
  EXPECT_EQ(out.packet_counter, 7);
  EXPECT_EQ(out.status_byte, 0x07);
  EXPECT_EQ(out.altitude_ellipsoid_m, 36.8125) << "a float, whatever its format bits say";
  EXPECT_TRUE(out.satellites);
}

}  // namespace
}  // namespace vergence::xbus
