#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace vergence::app {

/// Result of writing a report.
struct ReportOutcome {
  /// Path SESSION/report.html.
  std::filesystem::path page;
  /// Text "Good", "Usable with care" or "Do not use", with the reasons.
  std::string headline;
  /// False if no pose is reliable.
  bool usable = true;
  /// If not usable, the reason with counts, and what to do.
  std::string main_reason{};
  /// First part of the headline.
  std::string grade{};
  /// Message fragments, the worst first.
  std::vector<std::string> reasons{};
  /// Complete messages about what to do next.
  std::vector<std::string> advice{};
  /// Messages about files or lines that were missing, incomplete or not read.
  std::vector<std::string> missing{};
};

/// Three closing lines for the terminal: usable or not with the reason, what to do, and the path of
/// the report. `failure` is the reason for a missing report, empty otherwise.
[[nodiscard]] std::array<std::string, 3> closing_lines(const ReportOutcome& outcome,
                                                       const std::string& failure);

/// Writes SESSION/report.html from the session's other files: one self-contained page with inline
/// SVG and no script.
///
/// An incomplete session (killed, disk full) also gives a page; page and outcome list what is
/// missing. Text from files is escaped and bounded; any run gives at most some 3 MB. Thread-safe.
/// Uses some 400 bytes and constant time per frame. Throws InputError if the directory is missing
/// or has no session file, or the page cannot be written (an older one stays).
ReportOutcome write_report(const std::filesystem::path& session);

}  // namespace vergence::app
