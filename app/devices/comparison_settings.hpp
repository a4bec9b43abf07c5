#pragma once
#include "app/config/configuration.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app {

/// `comparison:`, and the INS's mount of `ins:`, as the comparison takes them. InputError: what
/// does not go together.
[[nodiscard]] ComparisonOptions comparison_options(const Configuration& configuration);

}  // namespace vergence::app
