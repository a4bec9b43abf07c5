#pragma once
#include <string>
#include <vector>

#include "app/doctor/checks.hpp"
#include "app/runtime/terminal_text.hpp"

namespace vergence::app {

/// A table for people: state, check, sentence, and below it the commands that mend. `given`: a
/// configuration was named.
[[nodiscard]] std::string doctor_text(const std::vector<Finding>& findings, bool given,
                                      const Terminal& terminal);
/// The same for programs; keys as in docs/doctor.md.
[[nodiscard]] std::string doctor_json(const std::vector<Finding>& findings);

}  // namespace vergence::app
