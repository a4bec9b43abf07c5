#pragma once
#include <string>
#include <vector>

#include "app/config/configuration.hpp"

namespace vergence::app {

/// Names of the cameras for files and sentences: those of the configuration (letters, digits, `_`
/// and `-`, everything else becomes `_`), `camera0` … where there is none, each once.
[[nodiscard]] std::vector<std::string> camera_names(const Configuration& configuration,
                                                    int cameras);

}  // namespace vergence::app
