#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "app/report/assessment.hpp"

namespace vergence::app {

/// Result of writing a report.
struct ReportOutcome {
  std::filesystem::path page{};  // SESSION/report.html
  report::Assessment assessment{};
  std::vector<std::string> missing{};  // messages: files or lines that were not there, not whole
};

/// The end of a drive for a terminal, three lines: usable or not and why, what to do, where the
/// report is. `failure`: why there is no report, empty: there is one.
[[nodiscard]] std::array<std::string, 3> closing_lines(const ReportOutcome& outcome,
                                                       const std::string& failure);

/// Writes SESSION/report.html from the session's other files: one self-contained page,
/// inline SVG, no script.
///
/// A torn session (killed, disk full) gives a page, too: what is missing is said on it and in the
/// outcome. Text from the files is escaped and bounded; a drive of any length gives a page of at
/// most some 3 MB.
/// Threads  Any; nothing is shared. Memory  Some 400 bytes a frame. Time  Linear in the frames.
/// Errors   InputError: no folder, nothing of a session in it, or the page cannot be written (an
///          older one is left as it was).
ReportOutcome write_report(const std::filesystem::path& session);

}  // namespace vergence::app
