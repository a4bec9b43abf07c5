#include "app/doctor/checks.hpp"

#include <algorithm>
#include <array>

namespace vergence::app {

const char* to_string(FindingState state) noexcept {
  constexpr std::array kNames{"ok", "advice", "problem"};
  return kNames.at(static_cast<std::size_t>(state));
}

bool CheckContext::is_of_service() const {
  return configuration.lexically_normal() == "/etc/vergence/rig.yaml" &&
         (machine.exists("/etc/systemd/system/vergence.service") ||
          machine.exists("/usr/lib/systemd/system/vergence.service"));
}

std::vector<Finding> run_checks(const CheckContext& context) {
  std::vector<Finding> findings;
  for (const auto check : {check_devices, check_network, check_system}) check(context, &findings);
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.state > b.state; });
  return findings;
}

}  // namespace vergence::app
