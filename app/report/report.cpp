#include "app/report/report.hpp"

#include <fmt/format.h>

#include "app/report/analysis.hpp"
#include "app/report/assessment.hpp"
#include "app/report/page.hpp"
#include "app/report/session.hpp"
#include "app/runtime/durable_file.hpp"

namespace vergence::app {
namespace {

/// The first of them, and how many more there are: a line of a terminal has no room for all.
std::string first_of(const std::vector<std::string>& messages, const char* none) {
  if (messages.empty()) return none;
  if (messages.size() == 1) return messages.front();
  return fmt::format("{} (and {} more in the report)", messages.front(), messages.size() - 1);
}

}  // namespace

ReportOutcome write_report(const std::filesystem::path& session_folder) {
  const report::Session session = report::read_session(session_folder);
  const report::Analysis analysis = report::analyse(session);
  const report::Assessment assessment = report::assess(session, analysis);
  ReportOutcome outcome;
  outcome.page = session_folder / "report.html";
  replace_durably(outcome.page, report::page_html(session, analysis, assessment));
  outcome.headline = std::string(report::to_words(assessment.grade)) + ": " + assessment.message;
  outcome.usable = assessment.usable;
  outcome.main_reason = assessment.main_reason;
  outcome.missing = session.not_had();
  outcome.grade = report::to_words(assessment.grade);
  outcome.reasons = assessment.reasons;
  outcome.advice = assessment.advice;
  return outcome;
}

std::array<std::string, 3> closing_lines(const ReportOutcome& outcome, const std::string& failure) {
  if (!failure.empty())
    return {"result: unknown, no report was written",
            "to do: free space or fix permissions, then run vergence report SESSION",
            "report: " + failure};
  const std::string why = outcome.reasons.empty() ? outcome.headline
                          : outcome.usable ? outcome.grade + ": " + first_of(outcome.reasons, "")
                                           : "do not use these poses: " + outcome.main_reason;
  return {"result: " + why, "to do: " + first_of(outcome.advice, "nothing"),
          "report: " + outcome.page.string()};
}

}  // namespace vergence::app
