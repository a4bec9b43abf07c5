#include "app/doctor/checks.hpp"

#include <algorithm>
#include <sstream>

namespace vergence::app {
namespace {

/// The service's unit where systemd looks for it, an administrator's own first, and what drop-ins
/// add.
std::optional<std::string> unit_of(const Machine& machine) {
  constexpr const char* kOwn = "/etc/systemd/system/vergence.service";
  auto unit = machine.text(kOwn);
  if (!unit) unit = machine.text("/usr/lib/systemd/system/vergence.service");
  if (!unit) return std::nullopt;
  const std::string drop_ins = std::string(kOwn) + ".d/";
  for (const std::string& name : machine.names(drop_ins))
    if (name.ends_with(".conf")) *unit += "\n" + machine.text(drop_ins + name).value_or("");
  return unit;
}

}  // namespace

const char* to_string(FindingState state) noexcept {
  switch (state) {
    case FindingState::problem:
      return "problem";
    case FindingState::advice:
      return "advice";
    case FindingState::ok:
      break;
  }
  return "ok";
}

bool CheckContext::is_of_service() const {
  return configuration.lexically_normal() == "/etc/vergence/rig.yaml" && unit_of(machine);
}

std::optional<std::string> CheckContext::service_setting(const std::string& key) const {
  std::istringstream lines(unit_of(machine).value_or(""));
  std::optional<std::string> value;
  for (std::string row; std::getline(lines, row);)
    if (row.starts_with(key + "=")) value = row.substr(key.size() + 1);
  return value;
}

std::vector<Finding> run_checks(const CheckContext& context) {
  std::vector<Finding> findings;
  for (const auto check :
       {check_cameras, check_network, check_usb, check_firewire, check_serial, check_system})
    check(context, &findings);
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.state > b.state; });
  return findings;
}

}  // namespace vergence::app
