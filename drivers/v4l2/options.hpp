#pragma once
#include <string>
#include <utility>
#include <vector>

#include "drivers/camera.hpp"

namespace vergence::v4l2 {

/// CameraConfiguration::options in their own types.
struct Options {
  Duration readout =
      Duration::nanoseconds(-1);  // negative: from the sensor's own figures, else zero
  int shift = -1;  // bits below the eight that are kept, of 16-bit formats; negative: by the format
  int thin = 1;    // the camera runs at so many times the rate, one image in each interval is kept
  int buffers = 16;
  std::string subdevice;        // node with the sensor's controls
  std::string trigger_control;  // key; "external": switched outside (module parameter, device tree)
  std::string trigger_value;
  double gain_step_db = 0;  // of the camera's gain control; 0: not known
  std::vector<std::pair<std::string, std::string>> controls;
};

/// False: *error says which option is wrong and what there is.
[[nodiscard]] bool parse_options(const CameraConfiguration& requested, Options* options,
                                 std::string* error);
/// What is wrong with the numbers by themselves; empty: nothing.
[[nodiscard]] std::string find_nonsense(const CameraConfiguration& requested);
/// A figure in a sentence, to six digits.
[[nodiscard]] std::string number_text(double value);

}  // namespace vergence::v4l2
