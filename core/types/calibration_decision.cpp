#include "core/types/calibration_decision.hpp"

#include "core/types/names.hpp"

namespace vergence {

std::string_view to_string(CalibrationCause c) noexcept {
  return name_of(c, std::array{"from_scratch", "knock", "drift", "collapse", "out_of_sync",
                               "requested", "refinement", "contradicted"});
}

}  // namespace vergence
