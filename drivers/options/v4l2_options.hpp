#pragma once
#include <string>
#include <utility>
#include <vector>

#include "core/types/time.hpp"
#include "drivers/options/option_table.hpp"

namespace vergence::v4l2 {

/// Options of V4L2 cameras. Ranges and meaning: option_table().
struct Options {
  Duration readout =
      Duration::nanoseconds(-1);  // negative: from the sensor's own figures, else zero
  int shift = -1;  // bits below the eight that are kept, of 16-bit formats; negative: by the format
  int thin = 1;    // the camera runs at so many times the rate, one image in each interval is kept
  int buffers = 16;
  std::string subdevice{};  // node with the sensor's controls
  std::string
      trigger_control{};  // name; `external`: switched outside (module parameter, device tree)
  std::string trigger_value{};
  double gain_step_db = 0;  // of the camera's gain control; 0: not known
  std::vector<std::pair<std::string, std::string>> controls{};  // of the camera, by their names
};

/// The table behind drivers/v4l2/README.md.
[[nodiscard]] const OptionTable<Options>& option_table();

}  // namespace vergence::v4l2
