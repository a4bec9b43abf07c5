#include "app/report/report.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "app/report/analysis.hpp"
#include "app/report/page.hpp"
#include "app/report/session.hpp"
#include "app/report/verdict.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// Beside the old one first, then in its place: a full disk leaves the old page whole.
void replace_file(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::path fresh = file;
  fresh += ".new";
  {
    std::ofstream out(fresh, std::ios::binary | std::ios::trunc);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.close();
    if (!out) {
      const int e = errno;
      std::error_code ignored;
      std::filesystem::remove(fresh, ignored);
      throw InputError(file.string() + ": cannot be written (" + std::strerror(e) +
                       "): check the folder's permissions and the disk's space");
    }
  }
  std::error_code error;
  std::filesystem::rename(fresh, file, error);
  if (!error) return;
  std::error_code ignored;
  std::filesystem::remove(fresh, ignored);
  throw InputError(file.string() + ": cannot be replaced (" + error.message() + "): is it a folder or write-protected?");
}

}  // namespace

ReportOutcome write_report(const std::filesystem::path& session_folder) {
  report::Session session = report::read_session(session_folder);
  const report::Analysis analysis = report::analyse(session);
  const report::Verdict verdict = report::judge(session, analysis);
  ReportOutcome outcome;
  outcome.page = session_folder / "report.html";
  replace_file(outcome.page, report::page_html(session, analysis, verdict));
  outcome.headline = std::string(report::to_words(verdict.grade)) + ": " + verdict.sentence;
  outcome.missing = std::move(session.missing);
  return outcome;
}

}  // namespace vergence::app
