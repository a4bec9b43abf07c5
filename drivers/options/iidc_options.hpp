#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/types/time.hpp"
#include "drivers/options/option_table.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"

namespace vergence::iidc {

/// Instant of the exposure that the camera stamps.
enum class StampedInstant : std::uint8_t { start, middle, end };

/// Half of FramePool::kMaxSlots, so that one range of slots holds two generations of a ring.
inline constexpr std::size_t kMaxBuffers = 32;

/// Options of IIDC cameras. option_table() has ranges and meaning.
struct Options {
  /// Always or never use Format 7; empty: if needed.
  std::optional<bool> format7{};
  /// Packet size of Format 7.
  std::optional<std::size_t> packet_bytes{};
  /// 0 or 14; empty: 14 if the camera supports it.
  std::optional<unsigned> trigger_mode{};
  /// Input number.
  unsigned trigger_source = 0;
  bool trigger_rising = true;
  /// Output that signals the exposure.
  std::optional<unsigned> strobe_pin{};
  bool strobe_high = true;
  /// If `strobe_duration` is 0, the strobe lasts as long as the exposure.
  Duration strobe_delay{}, strobe_duration{};
  std::optional<BusSpeed> speed{};
  std::size_t buffers = 20;
  /// Requests the embedded stamp and counter.
  bool embedded = true;
  StampedInstant stamped = StampedInstant::end;
};

/// Options documented in drivers/iidc/README.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::iidc
