#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/types/time.hpp"
#include "drivers/options/option_table.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"

namespace vergence::iidc {

/// The instant of the exposure that the camera stamps.
enum class StampedInstant : std::uint8_t { start, middle, end };

inline constexpr std::size_t kMaxBuffers =
    32;  // half of FramePool::kMaxSlots: two generations of a ring fit into one range of slots

/// Options of IIDC cameras. Ranges and meaning: option_table().
struct Options {
  std::optional<bool> format7{};              // only it, or never; empty: where needed
  std::optional<std::size_t> packet_bytes{};  // of Format 7
  std::optional<unsigned> trigger_mode{};     // 0 or 14; empty: 14 if the camera has it
  unsigned trigger_source = 0;                // input
  bool trigger_rising = true;
  std::optional<unsigned> strobe_pin{};  // output that shows the exposure
  bool strobe_high = true;
  Duration strobe_delay{}, strobe_duration{};  // duration 0: as long as the exposure
  std::optional<BusSpeed> speed{};
  std::size_t buffers = 20;
  bool embedded = true;  // ask for the embedded stamp and counter
  StampedInstant stamped = StampedInstant::end;
};

/// The table behind drivers/iidc/README.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::iidc
