#include "app/doctor/permissions.hpp"

#include <fmt/format.h>

namespace vergence::app {

std::vector<std::string> commands_to_install_rules() {
  return {"vergence devices --write-udev | sudo tee /etc/udev/rules.d/98-vergence-rig.rules",
          "sudo udevadm control --reload && sudo udevadm trigger"};
}

void check_nodes(const CheckContext& p, const NodesToOpen& what, std::vector<Finding>* findings) {
  std::vector<std::string> open, closed, stray;  // stray: closed, and not the group's
  for (const std::string& node : what.nodes) {
    if (p.machine.may_use(node)) {
      open.push_back(node);
      continue;
    }
    closed.push_back(node);
    if (p.machine.group_of(node) != what.group) stray.push_back(node);
  }
  if (closed.empty()) {
    if (!open.empty())
      findings->push_back({what.check,
                           FindingState::ok,
                           fmt::format("{} may be opened", fmt::join(open, ", ")),
                           {}});
    return;
  }
  if (!stray.empty())
    findings->push_back({what.check, FindingState::problem,
                         fmt::format("{} may not be opened, and not by group {} either: the udev "
                                     "rules are missing (install them, then "
                                     "unplug and plug in again)",
                                     fmt::join(stray, ", "), what.group),
                         commands_to_install_rules()});
  if (p.machine.in_group(what.group)) return;
  if (p.machine.listed_in_group(what.group))
    findings->push_back(
        {what.check,
         FindingState::problem,
         fmt::format(
             "{} may not be opened: {} is in group {} since after this login; log out and in again",
             fmt::join(closed, ", "), p.machine.user, what.group),
         {"newgrp " + what.group}});
  else
    findings->push_back(
        {what.check,
         FindingState::problem,
         fmt::format("{} may not be opened: {} is not in group {}; add, then log out and in again",
                     fmt::join(closed, ", "), p.machine.user, what.group),
         {fmt::format("sudo usermod -aG {} {}", what.group, p.machine.user)}});
}

}  // namespace vergence::app
