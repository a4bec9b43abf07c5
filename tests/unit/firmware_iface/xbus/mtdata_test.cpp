#include "firmware_iface/xbus/mtdata.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "firmware_iface/xbus/frame.hpp"
#include "tests/unit/firmware_iface/xbus/hex.hpp"

namespace vergence::xbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

Mtdata decoded(const Bytes& frame_bytes, const MtdataLayout& layout) {
  const ParsedFrame frame = parse_frame(frame_bytes);
  EXPECT_EQ(frame.status, FrameStatus::ok);
  EXPECT_TRUE(frame.message.is(MessageId::mtdata));
  Mtdata out;
  EXPECT_TRUE(decode_mtdata(frame.message.payload, layout, &out));
  return out;
}

// The cosine of 45°.
constexpr double kQuarter = 0.70710678118654752;

void expect_place(const Mtdata& m, double tolerance_deg) {
  ASSERT_TRUE(m.latitude_longitude_deg && m.altitude_m);
  EXPECT_NEAR((*m.latitude_longitude_deg)[0], -27.476543, tolerance_deg);
  EXPECT_NEAR((*m.latitude_longitude_deg)[1], 153.028765, tolerance_deg);
  EXPECT_EQ(*m.altitude_m, 52.25);
}

void expect_attitude(const Mtdata& m, double tolerance) {
  ASSERT_TRUE(m.quaternion);
  EXPECT_NEAR((*m.quaternion)[0], kQuarter, tolerance);
  EXPECT_EQ((*m.quaternion)[1], 0);
  EXPECT_EQ((*m.quaternion)[2], 0);
  EXPECT_NEAR((*m.quaternion)[3], kQuarter, tolerance);
}

TEST(Mtdata, floatFieldsAreDecoded) {
  const Mtdata m =
      decoded(from_hex("FA FF 32 4F 3E 00 00 00 BE 80 00 00 41 1D 00 00 3B 00 00 00 BC 00 00 00 3D "
                       "00 00 00 3F 00 00 00 BE 80 00 00 BF 40 00 00 3F 35 04 F3 00 00 00 00 00 00 "
                       "00 00 3F 35 04 F3 C1 DB CF F6 43 19 07 5D 42 51 00 00 41 28 00 00 BE 00 00 "
                       "00 3D 80 00 00 07 12 34 3B"),
              {0x0836, 0x001});
  expect_attitude(m, 1e-7);
  // The tolerance is half a step of a float at 153.
  expect_place(m, 1.4e-5);
  EXPECT_EQ(m.velocity, (Three{10.5, -0.125, 0.0625}));
  EXPECT_EQ(m.frame, LocalFrame::nwu);
  EXPECT_EQ(m.status, 7);
  EXPECT_EQ(m.sample_counter, 0x1234);
  EXPECT_FALSE(m.utc || m.fix || m.euler_deg);
}

void expect_same(const Utc& a, const Utc& b) {
  const auto all = [](const Utc& u) {
    return std::tuple(u.nanosecond, u.year, u.month, u.day, u.hour, u.minute, u.second, u.flags);
  };
  EXPECT_EQ(all(a), all(b));
}

TEST(Mtdata, receiverFixStaysIntegerInEveryFormat) {
  const Mtdata m =
      decoded(from_hex("FA FF 32 77 C5 E7 02 12 06 42 FA EF 9F 69 8A 5B 36 56 22 00 00 CC 1A 00 00 "
                       "04 1A FF FF FF F4 00 00 00 06 00 00 09 C4 00 00 0E D8 00 00 00 2D 03 B5 04 "
                       "F3 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 B5 04 F3 00 00 00 86 01 47 "
                       "28 FF E4 07 5D 24 9E 00 99 40 00 00 00 00 34 80 00 00 00 00 0A E0 00 00 00 "
                       "FF FF 10 00 00 00 00 00 07 12 34 0E E6 B2 80 07 DC 05 0E 03 04 05 07 96"),
              {0x1834, 0x203});
  ASSERT_TRUE(m.fix);
  const LegacyFix& f = *m.fix;
  EXPECT_EQ(
      std::tuple(f.horizontal_accuracy_mm, f.vertical_accuracy_mm, f.speed_accuracy_cm_s, f.age),
      std::tuple(2500, 3800, 45, 3));
  expect_attitude(m, 1e-7);
  expect_place(m, 0x1p-33);
  EXPECT_EQ(m.velocity, (Three{10.5, -0.125, 0.0625}));
  EXPECT_EQ(m.status, 7);
  EXPECT_EQ(m.sample_counter, 0x1234);
  ASSERT_TRUE(m.utc);
  expect_same(*m.utc, {250'000'000, 2012, 5, 14, 3, 4, 5, 7});
}

TEST(Mtdata, payloadOfWrongLengthIsRefused) {
  const Bytes bytes(74, 0);
  const MtdataLayout layout{0x0834, 0x203};
  ASSERT_EQ(layout.payload_size(), 75U);
  Mtdata out;
  out.status = 99;
  EXPECT_FALSE(decode_mtdata(bytes, layout, &out));
  EXPECT_FALSE(decode_mtdata(Bytes(76, 0), layout, &out));
  EXPECT_FALSE(decode_mtdata({}, layout, &out));
  EXPECT_EQ(out.status, 99) << "untouched";
}

TEST(Mtdata, invalidLayoutsAreRefused) {
  EXPECT_FALSE((MtdataLayout{0x4002, 0}).payload_size()) << "raw excludes calibrated";
  EXPECT_TRUE((MtdataLayout{0x5000, 0}).payload_size()) << "but not the receiver";
  EXPECT_FALSE((MtdataLayout{0x0004, 0xC}).payload_size()) << "the fourth kind of orientation";
  EXPECT_FALSE((MtdataLayout{0x0010, 1U << 14U}).payload_size())
      << "a position that is not latitude and longitude";
  EXPECT_FALSE((MtdataLayout{0x0020, 1U << 17U}).payload_size()) << "a velocity in another mode";
  EXPECT_FALSE((MtdataLayout{0x0040, 0}).payload_size()) << "a bit without a field";
  Mtdata out;
  EXPECT_FALSE(decode_mtdata({}, {0x0040, 0}, &out));
}

TEST(Mtdata, notANumberIsRefused) {
  Bytes bytes(16, 0);
  bytes[0] = 0x7F, bytes[1] = 0xC0;
  Mtdata out;
  EXPECT_FALSE(decode_mtdata(bytes, {kModeOrientation, kSettingsQuaternion}, &out));
}

/// A value that every format holds exactly.
template <std::size_t N>
std::array<double, N> exact(double first) {
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i)
    values[i] = (i % 2 == 0 ? 1 : -1) * (first + static_cast<double>(i) / 1024);
  return values;
}

TEST(Mtdata, everyLayoutRoundTrips) {
  Mtdata all{.fix = LegacyFix{2500, 3800, 45, 255},
             .quaternion = exact<4>(0.5),
             .euler_deg = exact<3>(170.5),
             .rotation_matrix = exact<9>(0.75),
             .latitude_longitude_deg = exact<2>(27.5),
             .altitude_m = -12.5,
             .velocity = exact<3>(33.25),
             .status = 0x47,
             .sample_counter = 65535,
             .utc = Utc{999'999'999, 2036, 12, 31, 23, 59, 60, 7}};
  int layouts = 0;
  for (unsigned mode = 0; mode < 0x8000; ++mode) {
    for (const std::uint32_t orientation : {kSettingsQuaternion, kSettingsEuler, kSettingsMatrix})
      for (std::uint32_t format = 0; format < 4; ++format) {
        // The bits that switch single fields off go round with the mode.
        const std::uint32_t off = (mode * 0x9E3779B1U) & 0xC70U, stamps = mode % 4;
        const MtdataLayout layout{
            static_cast<std::uint16_t>(mode),
            orientation | (format << 8U) | off | stamps | (mode % 3 == 0 ? kSettingsNed : 0U)};
        const std::optional<std::size_t> size = layout.payload_size();
        if (!size) continue;
        ++layouts;
        Bytes bytes(*size);
        ASSERT_EQ(encode_mtdata(all, layout, bytes), *size);
        Mtdata back;
        ASSERT_TRUE(decode_mtdata(bytes, layout, &back));
        Bytes again(*size);
        ASSERT_EQ(encode_mtdata(back, layout, again), *size);
        ASSERT_EQ(bytes, again) << mode;
        ASSERT_TRUE(!back.velocity || back.velocity == all.velocity);
        ASSERT_TRUE(!back.latitude_longitude_deg ||
                    back.latitude_longitude_deg == all.latitude_longitude_deg);
        ASSERT_TRUE(!back.rotation_matrix || back.rotation_matrix == all.rotation_matrix);
        ASSERT_TRUE(!back.fix || back.fix->age == 255);
        ASSERT_TRUE(!back.utc || back.utc->second == 60);
      }
  }
  EXPECT_GT(layouts, 3000);
}

TEST(Numbers, writtenNumbersAreRoundedAndSaturated) {
  const auto written = [](double v, NumberFormat f) {
    Bytes b(size_of(f));
    write_number(b, f, v);
    return read_number(b, f);
  };
  EXPECT_NEAR(written(-27.476543, NumberFormat::fp16_32), -27.476543, 0x1p-33);
  EXPECT_NEAR(written(-27.476543, NumberFormat::fp12_20), -27.476543, 0x1p-21);
  EXPECT_EQ(written(-0.5, NumberFormat::fp16_32), -0.5);
  EXPECT_EQ(written(1e9, NumberFormat::fp16_32), 32768 - 0x1p-32);
  EXPECT_EQ(written(-1e9, NumberFormat::fp16_32), -32768);
  EXPECT_EQ(written(1e9, NumberFormat::fp12_20), 2048 - 0x1p-20);
  EXPECT_EQ(written(-1e9, NumberFormat::fp12_20), -2048);
  EXPECT_EQ(written(std::numeric_limits<double>::quiet_NaN(), NumberFormat::fp12_20), 0);
  EXPECT_EQ(written(0.1, NumberFormat::float64), 0.1);
  EXPECT_EQ(written(0.1, NumberFormat::float32), static_cast<double>(0.1F));
}

TEST(Utc, unixNanosecondsRoundTripAndInvalidIsRefused) {
  const Utc utc{249'768'484, 2019, 1, 20, 13, 47, 24, 7};
  EXPECT_TRUE(plausible(utc));
  EXPECT_EQ(unix_ns(utc), 1'547'992'044'249'768'484);
  const Utc back = utc_of_unix_ns(1'547'992'044'249'768'484, 7);
  expect_same(back, utc);
  EXPECT_FALSE(plausible({0, 2019, 2, 29, 0, 0, 0, 7})) << "no leap year";
  EXPECT_TRUE(plausible({0, 2016, 12, 31, 23, 59, 60, 7})) << "a leap second";
  EXPECT_FALSE(plausible({1'000'000'000, 2019, 1, 1, 0, 0, 0, 7}));
  EXPECT_FALSE(plausible({0, 0, 0, 0, 0, 0, 0, 0})) << "what a device without a fix sends";
}

TEST(Utc, everyDayFrom1980To2199RoundTrips) {
  constexpr std::int64_t kDay = 86'400'000'000'000;
  const Utc first{0, 1980, 1, 1, 0, 0, 0, 7};
  ASSERT_EQ(unix_ns(first), 315'532'800'000'000'000);
  for (int i = 0; i < 80'000; ++i) {
    const std::int64_t ns = unix_ns(first) + i * kDay + i;
    const Utc utc = utc_of_unix_ns(ns, 7);
    ASSERT_TRUE(plausible(utc)) << i;
    ASSERT_EQ(unix_ns(utc), ns) << i;
  }
  EXPECT_EQ(utc_of_unix_ns(unix_ns({0, 2000, 2, 28, 0, 0, 0, 7}) + kDay, 7).day, 29)
      << "2000 was a leap year";
  EXPECT_EQ(utc_of_unix_ns(unix_ns({0, 2100, 2, 28, 0, 0, 0, 7}) + kDay, 7).month, 3)
      << "2100 will be none";
}

TEST(Mtdata, nedAndRotationMatrixAreDecoded) {
  const Mtdata fixed =
      decoded(from_hex("FA FF 32 39 80 00 00 00 00 01 C0 00 00 00 FF FD E0 00 00 00 FF 55 80 A3 D7 "
                       "0A FF E4 03 81 D7 DC 00 99 00 00 00 00 00 28 80 00 00 00 00 01 C0 00 00 00 "
                       "FF FD 20 00 00 00 00 00 05 00 00 E4"),
              {0x0834, 0x80000205});
  EXPECT_EQ(fixed.euler_deg, (Three{1.5, -2.25, -170.125}));
  EXPECT_EQ(fixed.frame, LocalFrame::ned);
  const Mtdata matrix =
      decoded(from_hex("FA FF 32 2A 42 16 00 00 00 00 00 00 BF 80 00 00 00 00 00 00 3F 80 00 00 00 "
                       "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 3F 80 00 00 01 00 8F"),
              {0x0005, 0x009});
  EXPECT_EQ(matrix.rotation_matrix, (std::array<double, 9>{0, -1, 0, 1, 0, 0, 0, 0, 1}));
  EXPECT_EQ(matrix.sample_counter, 256);
}

}  // namespace
}  // namespace vergence::xbus
