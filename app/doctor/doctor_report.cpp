#include "app/doctor/doctor_report.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace vergence::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kState = 9, kCheck = 19;  // columns

std::string state_text(FindingState state, const Terminal& t) {
  const std::string word = padded(to_string(state), kState);
  switch (state) {
    case FindingState::problem:
      return t.in(Terminal::Ink::red, word);
    case FindingState::advice:
      return t.in(Terminal::Ink::yellow, word);
    case FindingState::ok:
      break;
  }
  return t.in(Terminal::Ink::green, word);
}

std::size_t count(const std::vector<Finding>& findings, FindingState state) {
  return static_cast<std::size_t>(std::count_if(
      findings.begin(), findings.end(), [state](const Finding& f) { return f.state == state; }));
}

std::string total(const std::vector<Finding>& findings) {
  const std::size_t problems = count(findings, FindingState::problem),
                    advice = count(findings, FindingState::advice);
  std::string text = problems == 0   ? "No problem"
                     : problems == 1 ? "1 problem"
                                     : fmt::format("{} problems", problems);
  if (advice > 0) text += fmt::format(", {} piece{} of advice", advice, advice == 1 ? "" : "s");
  return text + fmt::format(", {} checked and well.", count(findings, FindingState::ok));
}

}  // namespace

std::string doctor_text(const std::vector<Finding>& findings, bool given, const Terminal& t) {
  std::string text;
  const std::string margin(kState + kCheck, ' ');
  for (const Finding& f : findings) {
    std::string head = state_text(f.state, t) + padded(f.check, kCheck);
    for (const std::string& line : wrapped(harmless(f.sentence), t.width - margin.size())) {
      text += head + line + "\n";
      head = margin;
    }
    for (const std::string& command : f.mend)
      text += margin + t.in(Terminal::Ink::bold, "  " + harmless(command)) +
              "\n";  // never broken: it is copied
    if (!f.mend.empty()) text += "\n";
  }
  if (!text.ends_with("\n\n")) text += "\n";
  text += total(findings) + "\n";
  if (!given)
    text += "Name a configuration to have checked what its drive needs: vergence doctor CONFIG\n";
  return text;
}

std::string doctor_json(const std::vector<Finding>& findings) {
  Json rows = Json::array();
  for (const Finding& f : findings)
    rows.push_back({{"check", f.check},
                    {"state", to_string(f.state)},
                    {"sentence", f.sentence},
                    {"mend", f.mend}});
  const Json all{{"problems", count(findings, FindingState::problem)},
                 {"advice", count(findings, FindingState::advice)},
                 {"ok", count(findings, FindingState::ok)},
                 {"findings", rows}};
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vergence::app
