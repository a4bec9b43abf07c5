#include "app/report/report.hpp"

#include "app/report/analysis.hpp"
#include "app/report/page.hpp"
#include "app/report/session.hpp"
#include "app/report/verdict.hpp"
#include "app/runtime/durable_file.hpp"

namespace vergence::app {

ReportOutcome write_report(const std::filesystem::path& session_folder) {
  report::Session session = report::read_session(session_folder);
  const report::Analysis analysis = report::analyse(session);
  const report::Verdict verdict = report::judge(session, analysis);
  ReportOutcome outcome;
  outcome.page = session_folder / "report.html";
  replace_durably(outcome.page, report::page_html(session, analysis, verdict));
  outcome.headline = std::string(report::to_words(verdict.grade)) + ": " + verdict.sentence;
  outcome.usable = verdict.usable;
  outcome.main_reason = verdict.main_reason;
  outcome.missing = std::move(session.missing);
  return outcome;
}

}  // namespace vergence::app
