#pragma once
#include <string>
#include <vector>

#include "app/doctor/checks.hpp"

namespace vergence::app {

/// Installs the rules that `vergence devices` writes.
[[nodiscard]] std::vector<std::string> commands_to_install_rules();

/// Nodes of one kind, and the group that should own them.
struct NodesToOpen {
  std::string check, group;
  std::vector<std::string> nodes;
  /// Of nodes that are not the group's: why not, and what gives them to it.
  std::string because = "the udev rules are missing (install them, then unplug and plug in again)";
  std::vector<std::string> mend = commands_to_install_rules();
};
/// Whether this user may read and write them, and if not by what: another login, membership, a
/// rule that gives the node to the group, or the node's mode. A closed node is always a problem.
void check_nodes(const CheckContext& context, const NodesToOpen& what,
                 std::vector<Finding>* findings);

}  // namespace vergence::app
