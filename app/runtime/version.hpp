#pragma once
#include <string_view>

namespace vergence::app {

/// Version printed by `--version` and stored in summary.json: the project's version and, in a build
/// from a git checkout, the commit: `0.1.0 (1a2b3c4)`, with `+` if files differed from it.
[[nodiscard]] std::string_view version() noexcept;

/// `schema_version` of the program's JSON, except `simulate` and `evaluate`. A change of a key's
/// name or meaning increases it.
inline constexpr int kSchemaVersion = 1;

}  // namespace vergence::app
