#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/report/report.hpp"
#include "app/runtime/progress.hpp"
#include "app/session/starting_calibration.hpp"
#include "app/session/summary.hpp"
#include "core/types/parallel.hpp"

/// Shared steps of commands that write a session directory.
namespace vergence::app {

/// Arena size for this number of bytes, with alignment of the first part.
[[nodiscard]] constexpr std::size_t arena_size(std::size_t bytes) { return bytes + 64; }

/// Runner with a worker thread next to the estimator if `threads` is at least two.
[[nodiscard]] std::unique_ptr<PairRunner> make_runner(int threads);

/// Fills in the calibration part of the summary.
void describe_calibration(const Estimator& estimator, const StartingCalibration& begin,
                          const SessionTotals& totals, const EstimatorOptions& options,
                          SummaryInput* input);

/// Message about an unverified calibration; empty if it is verified or there is none.
[[nodiscard]] std::string verification_message(const SummaryInput& input);

/// Writes summary.json of the session; problems become a message in *faults.
void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals,
                           const SummaryInput& input, std::vector<std::string>* faults);

/// Result of writing report.html.
struct SessionReport {
  ReportOutcome outcome{};
  /// Reason for a missing report; empty if it was written.
  std::string failure{};
};
[[nodiscard]] SessionReport write_session_report(const std::filesystem::path& session);

/// Prints closing_lines(); with `quiet` only the essential ones.
void print_verdict(const SessionReport& report, bool quiet, Progress* progress);

}  // namespace vergence::app
