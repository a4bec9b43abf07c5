#include "firmware_iface/iidc/bandwidth.hpp"

#include <algorithm>

namespace vergence::iidc {

std::string_view to_string(BusSpeed s) noexcept {
  switch (s) {
    case BusSpeed::s100:
      return "S100";
    case BusSpeed::s200:
      return "S200";
    case BusSpeed::s400:
      return "S400";
    case BusSpeed::s800:
      return "S800";
  }
  return "unknown speed";
}

std::size_t packet_for_units(unsigned units, BusSpeed speed) noexcept {
  const std::size_t quadlets = units >> (4U - static_cast<unsigned>(speed));
  return quadlets <= 3 ? 0 : std::min((quadlets - 3) * 4, largest_packet(speed));
}

}  // namespace vergence::iidc
