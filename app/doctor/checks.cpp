#include "app/doctor/checks.hpp"

#include <algorithm>

namespace vergence::app {

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
