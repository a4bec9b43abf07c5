#include "app/report/findings.hpp"

#include <algorithm>

namespace vergence::app::report {

void Findings::find(Grade grade, std::string reason) {
  found_.push_back({grade, std::move(reason)});
  verdict_.grade = std::max(verdict_.grade, grade);
}

void Findings::give_up(const std::string& reason, const std::string& advice) {
  verdict_.usable = false;
  if (verdict_.main_reason.empty())
    verdict_.main_reason = reason + (advice.empty() ? "" : ". " + advice);
}

Verdict Findings::verdict() const {
  std::vector<Found> sorted = found_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Found& a, const Found& b) { return a.grade > b.grade; });
  Verdict verdict = verdict_;
  for (Found& f : sorted) verdict.reasons.push_back(std::move(f.reason));
  return verdict;
}

}  // namespace vergence::app::report
