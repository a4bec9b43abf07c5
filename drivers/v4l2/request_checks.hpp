#pragma once
#include <string>

#include "drivers/camera.hpp"

namespace vergence::v4l2 {

/// What is wrong with the numbers by themselves; empty: nothing.
[[nodiscard]] std::string find_invalid(const CameraConfiguration& requested);
/// A figure in a sentence, to six digits.
[[nodiscard]] std::string number_text(double value);

}  // namespace vergence::v4l2
