#include "app/report/report.hpp"

#include <fmt/format.h>

#include "app/report/analysis.hpp"
#include "app/report/page.hpp"
#include "app/report/session.hpp"
#include "app/report/verdict.hpp"
#include "app/runtime/durable_file.hpp"

namespace vergence::app {
namespace {

/// The first of them, and how many more there are: a line of a terminal has no room for all.
std::string first_of(const std::vector<std::string>& sentences, const char* none) {
  if (sentences.empty()) return none;
  if (sentences.size() == 1) return sentences.front();
  return fmt::format("{} (and {} more in the report)", sentences.front(), sentences.size() - 1);
}

}  // namespace

ReportOutcome write_report(const std::filesystem::path& session_folder) {
  const report::Session session = report::read_session(session_folder);
  const report::Analysis analysis = report::analyse(session);
  const report::Verdict verdict = report::judge(session, analysis);
  ReportOutcome outcome;
  outcome.page = session_folder / "report.html";
  replace_durably(outcome.page, report::page_html(session, analysis, verdict));
  outcome.headline = std::string(report::to_words(verdict.grade)) + ": " + verdict.sentence;
  outcome.usable = verdict.usable;
  outcome.main_reason = verdict.main_reason;
  outcome.missing = session.not_had();
  outcome.grade = report::to_words(verdict.grade);
  outcome.reasons = verdict.reasons;
  outcome.advice = verdict.advice;
  return outcome;
}

std::array<std::string, 3> closing_lines(const ReportOutcome& outcome, const std::string& failure) {
  if (!failure.empty())
    return {"verdict: not known, there is no report",
            "to do: mend what keeps the report from being written, then vergence report SESSION",
            "report: " + failure};
  const std::string why = outcome.reasons.empty() ? outcome.headline
                          : outcome.usable ? outcome.grade + ": " + first_of(outcome.reasons, "")
                                           : "do not use these poses: " + outcome.main_reason;
  return {"verdict: " + why,
          "to do: " + first_of(outcome.advice, "nothing, these poses can be used as they are"),
          "report: " + outcome.page.string()};
}

}  // namespace vergence::app
