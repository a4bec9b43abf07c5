#pragma once
#include <vector>

#include "firmware_iface/iidc/config_rom.hpp"

namespace vergence::iidc {

/// The ROM of a 1.31 camera, laid out as cameras do it. Its quadlets are: 0 the bus information
/// block; 5 the root directory, whose unit is at 8 + 2; 10 the unit directory, whose dependent
/// directory is at 13 + 2; 15 the dependent directory, whose texts are at 17 + 3, "Point Grey", and
/// at 26, "Flea3". Quadlets 9 and 14 are holes.
inline std::vector<std::uint32_t> example_rom() {
  return {0x0404'0000, 0x3133'3934, 0x2000'A002, 0x00B0'9D01, 0x0012'3456, 0x0003'0000, 0x0300'B09D,
          0x0C00'83C0, 0xD100'0002, 0,           0x0003'0000, 0x1200'A02D, 0x1300'0102, 0xD400'0002,
          0,           0x0004'0000, 0x403C'0000, 0x8100'0003, 0x8200'0008, 0x3800'0010, 0x0005'0000,
          0,           0,           0x506F'696E, 0x7420'4772, 0x6579'0000, 0x0004'0000, 0,
          0,           0x466C'6561, 0x3300'0000};
}

}  // namespace vergence::iidc
