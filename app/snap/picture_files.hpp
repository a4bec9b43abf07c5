#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "app/config/configuration.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// Names of the cameras for files and sentences: those of the configuration (letters, digits, `_` and `-`, everything else becomes `_`),
/// `camera0` … where there is none, each once.
[[nodiscard]] std::vector<std::string> camera_names(const Configuration& configuration, int cameras);

/// An 8-bit grey PNG. InputError: it cannot be written.
void write_png(const std::filesystem::path& file, const ImageView& image);

}  // namespace vergence::app
