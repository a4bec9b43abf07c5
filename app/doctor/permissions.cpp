#include "app/doctor/permissions.hpp"

#include <fmt/format.h>

namespace vergence::app {
namespace {

/// Nodes by what keeps this user from them.
struct SortedNodes {
  std::vector<std::string> open, closed;
  std::vector<std::string> stray;    // closed, and not the group's
  std::vector<std::string> narrow;   // the group's, which may not read and write them either
  std::vector<std::string> refused;  // open to this user by group and mode, and closed all the same
};

SortedNodes sorted_nodes(const Machine& machine, const NodesToOpen& what) {
  constexpr unsigned kGroupMay = 0060;
  SortedNodes s;
  for (const std::string& node : what.nodes) {
    if (machine.may_use(node)) {
      s.open.push_back(node);
      continue;
    }
    s.closed.push_back(node);
    if (machine.group_of(node) != what.group)
      s.stray.push_back(node);
    else if ((machine.mode_of(node).value_or(kGroupMay) & kGroupMay) != kGroupMay)
      s.narrow.push_back(node);
    else if (machine.in_group(what.group))
      s.refused.push_back(node);
  }
  return s;
}

void report_narrow(const CheckContext& p, const NodesToOpen& what, const SortedNodes& sorted,
                   std::vector<Finding>* findings) {
  for (const std::string& node : sorted.narrow) {
    std::vector<std::string> mend{"sudo chmod g+rw " + node};
    mend.insert(mend.end(), what.mend.begin(), what.mend.end());
    findings->push_back(
        {what.check, FindingState::problem,
         fmt::format("{} may not be opened by group {}: its mode is {:04o}; rw for the group is "
                     "needed",
                     node, what.group, p.machine.mode_of(node).value_or(0)),
         std::move(mend)});
  }
}

void report_membership(const CheckContext& p, const NodesToOpen& what, const SortedNodes& sorted,
                       std::vector<Finding>* findings) {
  if (p.machine.listed_in_group(what.group))
    findings->push_back({what.check,
                         FindingState::problem,
                         fmt::format("{} may not be opened: {} is in group {} since after this "
                                     "login; log out and in again",
                                     fmt::join(sorted.closed, ", "), p.machine.user, what.group),
                         {"newgrp " + what.group}});
  else
    findings->push_back(
        {what.check,
         FindingState::problem,
         fmt::format("{} may not be opened: {} is not in group {}; add, then log out and in again",
                     fmt::join(sorted.closed, ", "), p.machine.user, what.group),
         {fmt::format("sudo usermod -aG {} {}", what.group, p.machine.user)}});
}

}  // namespace

std::vector<std::string> commands_to_install_rules() {
  return {"vergence devices --write-udev | sudo tee /etc/udev/rules.d/98-vergence-rig.rules",
          "sudo udevadm control --reload && sudo udevadm trigger"};
}

void check_nodes(const CheckContext& p, const NodesToOpen& what, std::vector<Finding>* findings) {
  const SortedNodes sorted = sorted_nodes(p.machine, what);
  if (sorted.closed.empty()) {
    if (!sorted.open.empty())
      findings->push_back({what.check,
                           FindingState::ok,
                           fmt::format("{} may be opened", fmt::join(sorted.open, ", ")),
                           {}});
    return;
  }
  if (!sorted.stray.empty())
    findings->push_back({what.check, FindingState::problem,
                         fmt::format("{} may not be opened, and not by group {} either: {}",
                                     fmt::join(sorted.stray, ", "), what.group, what.because),
                         what.mend});
  report_narrow(p, what, sorted, findings);
  if (!sorted.refused.empty())
    findings->push_back({what.check,
                         FindingState::problem,
                         fmt::format("{} may not be opened, though group {} may by its mode: an "
                                     "access list or a container keeps it closed",
                                     fmt::join(sorted.refused, ", "), what.group),
                         {fmt::format("getfacl {}", fmt::join(sorted.refused, " "))}});
  if (!p.machine.in_group(what.group)) report_membership(p, what, sorted, findings);
}

}  // namespace vergence::app
