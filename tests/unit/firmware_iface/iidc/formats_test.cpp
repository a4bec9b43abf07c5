#include "firmware_iface/iidc/formats.hpp"

#include <gtest/gtest.h>

#include "firmware_iface/iidc/bandwidth.hpp"

namespace vergence::iidc {
namespace {

FixedMode find(unsigned format, unsigned mode) {
  for (const FixedMode& m : fixed_modes())
    if (m.format == format && m.mode == mode) return m;
  return {};
}

TEST(Formats, sizesAndPacketsAreThoseOfTheStandard) {
  struct Row {
    unsigned format, mode, width, height, rate_code;
    std::size_t packet;
  };
  // Packet bytes from the format tables of the standard (lines a packet times bytes a line).
  for (const Row& r :
       {Row{0, 0, 160, 120, 4, 240}, Row{0, 1, 320, 240, 4, 640}, Row{0, 3, 640, 480, 4, 2560},
        Row{0, 5, 640, 480, 4, 1280}, Row{0, 5, 640, 480, 1, 160}, Row{0, 6, 640, 480, 4, 2560},
        Row{1, 2, 800, 600, 4, 2000}, Row{1, 5, 1024, 768, 4, 3072}, Row{1, 5, 1024, 768, 3, 1536},
        Row{2, 2, 1280, 960, 4, 5120}, Row{2, 2, 1280, 960, 2, 1280},
        Row{2, 5, 1600, 1200, 4, 8000}}) {
    const FixedMode m = find(r.format, r.mode);
    EXPECT_EQ(m.width, r.width) << r.format << '/' << r.mode;
    EXPECT_EQ(m.height, r.height) << r.format << '/' << r.mode;
    EXPECT_EQ(fixed_packet_bytes(m, r.rate_code), r.packet) << r.format << '/' << r.mode;
  }
}

TEST(Formats, fixedModePacketsDivideTheFrameInQuadlets) {
  for (const FixedMode& m : fixed_modes())
    for (unsigned code = 0; code < kRates; ++code) {
      const std::size_t packet = fixed_packet_bytes(m, code);
      if (packet == 0) continue;
      EXPECT_EQ(packet % 4, 0U);
      EXPECT_EQ(frame_bytes(m.width, m.height, m.coding) % packet, 0U);
      // The frame's packets fit into the cycles of its period.
      EXPECT_LE(static_cast<double>(frame_bytes(m.width, m.height, m.coding) / packet),
                kCyclesPerSecond / rate_of(code));
    }
}

TEST(Formats, format7PacketIsTheSmallestReachingTheRate) {
  // 307200 bytes: 1024 a packet is 300 packets and one idle cycle.
  EXPECT_NEAR(packet_rate(307200, 1024), 8000.0 / 301, 1e-12);
  for (const double rate : {1.0, 7.5, 10.0, 26.0, 30.0, 60.0, 100.0})
    for (const std::size_t unit : {4U, 8U, 96U}) {
      const std::size_t packet = packet_for_rate(307200, rate, unit, 4096);
      ASSERT_GT(packet, 0U) << rate;
      EXPECT_EQ(packet % unit, 0U);
      EXPECT_GE(packet_rate(307200, packet), rate * (1 - 1e-9));
      if (packet > unit) {
        EXPECT_LT(packet_rate(307200, packet - unit), rate);
      }
    }
  // S400 cannot carry this rate.
  EXPECT_EQ(packet_for_rate(1280 * 960, 30, 4, 4096), 0U);
  // The rate needs 306 packets and an idle cycle.
  EXPECT_EQ(packet_for_rate(1280 * 960, 26, 4, 4096), 4016U);
  // The rate needs 265 packets.
  EXPECT_EQ(packet_for_rate(1280 * 960, 30, 4, 8192), 4640U);
}

TEST(Formats, invalidArgumentsGiveZero) {
  EXPECT_EQ(packet_for_rate(0, 30, 4, 4096), 0U);
  EXPECT_EQ(packet_for_rate(1000, 0, 4, 4096), 0U);
  EXPECT_EQ(packet_for_rate(1000, 30, 0, 4096), 0U);
  EXPECT_EQ(packet_for_rate(1000, 1e9, 4, 4096), 0U);
  EXPECT_EQ(packet_for_rate(1000, 1e-300, 4, 4096), 4U);
  EXPECT_EQ(packets_for(1000, 0), 0U);
  EXPECT_EQ(packet_rate(1000, 0), 0);
  EXPECT_EQ(fixed_packet_bytes(FixedMode{}, 99), 0U);
  EXPECT_EQ(bits_per_pixel(static_cast<ColorCoding>(77)), 0U);
}

TEST(Bandwidth, unitsAreThoseTheBusManagerCounts) {
  EXPECT_EQ(bandwidth_units(1280, BusSpeed::s400), 1292U);
  EXPECT_EQ(bandwidth_units(1476, BusSpeed::s400), 1488U);
  EXPECT_EQ(bandwidth_units(4608, BusSpeed::s800), 2310U);
  EXPECT_EQ(bandwidth_units(6680, BusSpeed::s800), 3346U);
  EXPECT_EQ(bandwidth_units(1024, BusSpeed::s100), 4144U);
  EXPECT_EQ(bandwidth_units(1024, BusSpeed::s200), 2072U);
}

TEST(Bandwidth, packetForUnitsIsTheLargestThatFits) {
  for (const BusSpeed speed : {BusSpeed::s100, BusSpeed::s200, BusSpeed::s400, BusSpeed::s800})
    for (unsigned units = 0; units <= kBandwidthUnits; units += 7) {
      const std::size_t packet = packet_for_units(units, speed);
      EXPECT_EQ(packet % 4, 0U);
      EXPECT_LE(packet, largest_packet(speed));
      if (packet > 0) {
        EXPECT_LE(bandwidth_units(packet, speed), units);
      }
      if (packet < largest_packet(speed)) {
        EXPECT_GT(bandwidth_units(packet + 4, speed), units);
      }
    }
}

}  // namespace
}  // namespace vergence::iidc
