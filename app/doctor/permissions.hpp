#pragma once
#include <string>
#include <vector>

#include "app/doctor/checks.hpp"

namespace vergence::app {

/// Nodes of one kind, and the group that should own them.
struct NodesToOpen {
  std::string check, group;
  std::vector<std::string> nodes;
};
/// Whether this user may read and write them, and if not by what: another login, membership, or a
/// rule that gives the node to the group.
void check_nodes(const CheckContext& context, const NodesToOpen& what,
                 std::vector<Finding>* findings);

/// Installs the rules that `vergence devices` writes.
[[nodiscard]] std::vector<std::string> commands_to_install_rules();

}  // namespace vergence::app
