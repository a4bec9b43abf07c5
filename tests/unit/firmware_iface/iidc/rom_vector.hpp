#pragma once
#include <cstdint>
#include <vector>

#include "firmware_iface/iidc/config_rom.hpp"

namespace vergence::iidc {

/// The ROM of a 1.31 camera, laid out as cameras do it: bus block, root, unit, unit-dependent
/// directory, two text leaves.
inline std::vector<std::uint32_t> example_rom() {
  return {
      0x0404'0000, 0x3133'3934, 0x2000'A002, 0x00B0'9D01, 0x0012'3456,  // 0: bus information block
      0x0003'0000, 0x0300'B09D, 0x0C00'83C0, 0xD100'0002,               // 5: root; unit at 8 + 2
      0x0000'0000,                                                      // 9: a hole
      0x0003'0000, 0x1200'A02D, 0x1300'0102, 0xD400'0002,  // 10: unit; dependent at 13 + 2
      0x0000'0000,                                         // 14: a hole
      0x0004'0000, 0x403C'0000, 0x8100'0003, 0x8200'0008, 0x3800'0010,  // 15: dependent
      0x0005'0000, 0,           0,           0x506F'696E, 0x7420'4772,
      0x6579'0000,                                                      // 20 = 17 + 3: "Point Grey"
      0x0004'0000, 0,           0,           0x466C'6561, 0x3300'0000,  // 26: "Flea3"
  };
}

}  // namespace vergence::iidc
