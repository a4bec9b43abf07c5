#pragma once
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

/// One worker beside the estimator with two threads or more.
[[nodiscard]] std::unique_ptr<PairRunner> make_runner(int threads);

/// The calibration's part of the summary.
void describe_calibration(const Estimator& estimator, const StartingCalibration& begin,
                          const SessionTotals& totals, const EstimatorOptions& options,
                          SummaryInput* input);

/// Returns the message about an unverified calibration; empty if it is verified or there is
/// none.
[[nodiscard]] std::string verification_message(const SummaryInput& input);

/// summary.json of the session; what goes wrong becomes a message of *faults.
void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals,
                           const SummaryInput& input, std::vector<std::string>* faults);

/// Result of writing report.html.
struct SessionReport {
  ReportOutcome outcome{};
  // Reason why there is no report; empty if there is one.
  std::string failure{};
};
[[nodiscard]] SessionReport write_session_report(const std::filesystem::path& session);

/// Prints closing_lines(); with `quiet` only those that must not be missed.
void print_verdict(const SessionReport& report, bool quiet, Progress* progress);

}  // namespace vergence::app
