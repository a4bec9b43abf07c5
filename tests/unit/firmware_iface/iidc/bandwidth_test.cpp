#include "firmware_iface/iidc/bandwidth.hpp"

#include <gtest/gtest.h>

namespace vergence::iidc {
namespace {

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
