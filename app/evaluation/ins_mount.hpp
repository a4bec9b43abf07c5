#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "core/math/se3.hpp"

namespace vergence::app {

/// How an INS is brought to the left camera where no mount is looked for.
struct InsMount {
  Transform T_ins_left{};
  std::string source{};    // where it is from
  bool axes_only = false;  // nobody says: a camera that looks along the INS's x, at its place
};

/// The mount that the sessions around these files or folders compared with, of the first that has
/// one in its summary.json; else the axes alone.
[[nodiscard]] InsMount ins_mount_of(const std::filesystem::path& estimate,
                                    const std::filesystem::path& readings);

/// For a machine, as summary.json has it.
[[nodiscard]] nlohmann::ordered_json ins_mount_json(const InsMount& mount);
/// For a person, a line with its end.
[[nodiscard]] std::string ins_mount_text(const InsMount& mount);

}  // namespace vergence::app
