#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/types/time.hpp"
#include "drivers/device.hpp"
#include "firmware_iface/iidc/bandwidth.hpp"

namespace vergence::iidc {

/// The instant of the exposure that the camera stamps.
enum class StampedInstant : std::uint8_t { start, middle, end };

/// What only IIDC cameras have: CameraConfiguration::options, checked.
struct CameraOptions {
  std::optional<bool> format7;              // only it, or never; empty: where needed
  std::optional<std::size_t> packet_bytes;  // of Format 7
  std::optional<unsigned> trigger_mode;     // 0 or 14; empty: 14 if the camera has it
  unsigned trigger_source = 0;              // input
  bool trigger_rising = true;
  std::optional<unsigned> strobe_pin;  // output that shows the exposure
  bool strobe_high = true;
  Duration strobe_delay{}, strobe_duration{};  // duration 0: as long as the exposure
  std::optional<BusSpeed> speed;
  std::size_t buffers = 20;
  bool embedded = true;  // ask for the embedded stamp and counter
  StampedInstant stamped = StampedInstant::end;
};

/// Reads them. → ok, unsupported (a name that does not exist), bad_configuration (a value that
/// cannot be); then *error says which.
[[nodiscard]] DeviceStatus parse_options(const std::map<std::string, std::string>& given,
                                         CameraOptions* options, std::string* error);

}  // namespace vergence::iidc
