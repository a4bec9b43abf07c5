#pragma once
#include <cstdio>
#include <string>
#include <vector>

#include "firmware_iface/nmea/nmea.hpp"
#include "firmware_iface/ubx/ubx.hpp"

namespace vergence::test {

/// `$body*hh\r\n`
[[nodiscard]] inline std::string nmea_sentence(const std::string& body) {
  std::array<char, 8> sum{};
  (void)std::snprintf(sum.data(), sum.size(), "*%02X", static_cast<unsigned>(nmea::checksum(body)));
  return "$" + body + sum.data() + "\r\n";
}

/// A NAV-PVT payload of u-blox 8 and later with a 3D fix in Brisbane.
struct PvtBytes {
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(92);

  PvtBytes() {
    put(4, 2, 2024), put(6, 1, 2), put(7, 1, 29);
    put(8, 1, 1), put(9, 1, 23), put(10, 1, 45);
    put(11, 1, 7), put(20, 1, 3), put(21, 1, 1), put(23, 1, 17);
    put(24, 4, 1530137000), put(28, 4, -274975000), put(32, 4, 60000);
    put(40, 4, 1414), put(44, 4, 2000), put(68, 4, 100), put(76, 2, 120);
    // The velocity is north, east and down in mm/s.
    put(48, 4, 3000), put(52, 4, 4000), put(56, 4, -500);
    // The velocity is 5 m/s at 53.1301°.
    put(60, 4, 5000), put(64, 4, 5313010);
  }
  void put(std::size_t at, std::size_t size, std::int64_t value) {
    for (std::size_t i = 0; i < size; ++i)
      bytes[at + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
  [[nodiscard]] std::string frame() const {
    std::vector<std::uint8_t> out(bytes.size() + ubx::kOverhead);
    (void)ubx::write_frame(1, 7, bytes, out);
    return {out.begin(), out.end()};
  }
};

}  // namespace vergence::test
