#pragma once
#include <array>

#include "app/report/assessment.hpp"

namespace vergence::app {

/// Result of writing a report.
struct ReportOutcome {
  // The page is SESSION/report.html.
  std::filesystem::path page{};
  report::Assessment assessment{};
  // Messages about files or lines that are missing or truncated.
  std::vector<std::string> missing{};
};

/// Three closing lines for the terminal: usable or not with the reason, what to do, and the path of
/// the report.
[[nodiscard]] std::array<std::string, 3> closing_lines(const ReportOutcome& outcome);

/// Writes SESSION/report.html from the session's other files: one self-contained page with inline
/// SVG and no script.
///
/// An incomplete session (killed, disk full) also gives a page; page and outcome list what is
/// missing. Text from files is escaped and bounded; any run gives at most some 3 MB. Thread-safe.
/// Uses some 400 bytes and constant time per frame. Throws InputError if the directory is missing
/// or has no session file, or the page cannot be written (an older one stays).
ReportOutcome write_report(const std::filesystem::path& session);

}  // namespace vergence::app
