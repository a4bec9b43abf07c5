#pragma once
#include <cstdint>
#include <vector>

#include "firmware_iface/iidc/config_rom.hpp"

namespace vergence::iidc {

/// The ROM of a 1.31 camera, laid out as cameras do it: bus block, root, unit, unit-dependent
/// directory, two text leaves.
inline std::vector<std::uint32_t> example_rom() {
  return {
      // 0: bus information block.
      0x0404'0000,
      0x3133'3934,
      0x2000'A002,
      0x00B0'9D01,
      0x0012'3456,
      // 5: root directory; the unit directory is at 8 + 2.
      0x0003'0000,
      0x0300'B09D,
      0x0C00'83C0,
      0xD100'0002,
      // 9: hole.
      0x0000'0000,
      // 10: unit directory; the dependent directory is at 13 + 2.
      0x0003'0000,
      0x1200'A02D,
      0x1300'0102,
      0xD400'0002,
      // 14: hole.
      0x0000'0000,
      // 15: unit-dependent directory; 20 = 17 + 3 is "Point Grey".
      0x0004'0000,
      0x403C'0000,
      0x8100'0003,
      0x8200'0008,
      0x3800'0010,
      0x0005'0000,
      0,
      0,
      0x506F'696E,
      0x7420'4772,
      0x6579'0000,
      // 26: "Flea3".
      0x0004'0000,
      0,
      0,
      0x466C'6561,
      0x3300'0000,
  };
}

}  // namespace vergence::iidc
