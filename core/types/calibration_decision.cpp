#include "core/types/calibration_decision.hpp"

#include <array>

namespace vergence {

std::string_view to_string(CalibrationCause c) noexcept {
  static constexpr std::array<std::string_view, 8> names = {
      "from_scratch", "knock",     "drift",      "collapse",
      "out_of_step",  "requested", "refinement", "contradicted"};
  return names[static_cast<std::size_t>(c)];
}

}  // namespace vergence
