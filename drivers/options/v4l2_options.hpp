#pragma once
#include <string>
#include <utility>
#include <vector>

#include "core/types/time.hpp"
#include "drivers/options/option_table.hpp"

namespace vergence::v4l2 {

/// Options of V4L2 cameras. option_table() has ranges and meaning.
struct Options {
  /// Negative: derived from the sensor's timing, else zero.
  Duration readout = Duration::nanoseconds(-1);
  /// Low bits dropped in 16-bit formats; negative: by the format.
  int shift = -1;
  /// Factor by which the camera runs faster than the kept frames.
  int thin = 1;
  int buffers = 16;
  /// Node with the sensor's controls.
  std::string subdevice{};
  /// Name of the control; `external` means that the trigger is enabled elsewhere (module parameter,
  /// device tree).
  std::string trigger_control{};
  std::string trigger_value{};
  /// Step of the camera's gain control; 0 if unknown.
  double gain_step_db = 0;
  /// Further controls by the camera's own names.
  std::vector<std::pair<std::string, std::string>> controls{};
};

/// Options documented in drivers/v4l2/README.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::v4l2
