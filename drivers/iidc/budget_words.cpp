#include "drivers/iidc/budget_words.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "firmware_iface/iidc/formats.hpp"

namespace vergence::iidc {

std::string budget_error(std::span<const BusShare> shares) {
  const unsigned need = total_units(shares);
  if (shares.empty() || need <= kBandwidthUnits) return {};
  std::string text =
      std::to_string(shares.size()) + (shares.size() == 1 ? " camera needs " : " cameras need ");
  for (std::size_t i = 0; i < shares.size(); ++i)
    text += (i == 0 ? "" : " + ") +
            std::to_string(bandwidth_units(shares[i].packet_bytes, shares[i].speed));
  if (shares.size() > 1) text += " = " + std::to_string(need);
  text += " of the bus's " + std::to_string(kBandwidthUnits) + " bandwidth units";
  BusSpeed slowest = BusSpeed::s800;
  std::size_t image = 0;
  for (const BusShare& s : shares) {
    slowest = std::min(slowest, s.speed);
    image = std::max(image, s.image_bytes);
  }
  const std::size_t packet =
      packet_for_units(kBandwidthUnits / static_cast<unsigned>(shares.size()), slowest);
  std::array<char, 160> advice{};
  (void)std::snprintf(advice.data(), advice.size(),
                      "; packets of at most %zu bytes each (%.4g Hz at this size) fit at %s",
                      packet, packet_rate(image, packet), std::string(to_string(slowest)).c_str());
  text += advice.data();
  text += slowest == BusSpeed::s800
              ? ": lower the rate or the image size, or use a second bus"
              : ": lower the rate or the image size, or use S800 or a second bus";
  return text;
}

}  // namespace vergence::iidc
