#include "app/report/report.hpp"

#include <fmt/format.h>

#include "app/report/page.hpp"
#include "app/runtime/durable_file.hpp"

namespace vergence::app {
namespace {

/// The first of them, and how many more there are: a line of a terminal has no room for all.
std::string first_message(const std::vector<std::string>& messages, const char* none) {
  if (messages.empty()) return none;
  if (messages.size() == 1) return messages.front();
  return fmt::format("{} (and {} more in the report)", messages.front(), messages.size() - 1);
}

}  // namespace

ReportOutcome write_report(const std::filesystem::path& session_folder) {
  const report::Session session = report::read_session(session_folder);
  const report::Analysis analysis = report::analyse(session);
  ReportOutcome outcome;
  outcome.page = session_folder / "report.html";
  outcome.assessment = report::assess(session, analysis);
  outcome.missing = session.missing;
  replace_durably(outcome.page, report::page_html(session, analysis, outcome.assessment));
  return outcome;
}

std::array<std::string, 3> closing_lines(const ReportOutcome& outcome) {
  const report::Assessment& a = outcome.assessment;
  const std::string why = a.usable ? fmt::format("{}: {}", report::spaced(a.grade),
                                                 first_message(a.reasons, a.message.c_str()))
                                   : "do not use these poses: " + a.main_reason;
  return {"result: " + why, "to do: " + first_message(a.advice, "nothing"),
          "report: " + outcome.page.string()};
}

}  // namespace vergence::app
