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

/// What every command that writes a session folder does alike.
namespace vergence::app {

/// What an arena needs beside its contents: the first piece is aligned, too.
[[nodiscard]] constexpr std::size_t arena_size(std::size_t bytes) { return bytes + 64; }

/// One worker beside the estimator with two threads or more.
[[nodiscard]] std::unique_ptr<PairRunner> make_runner(int threads);

/// The calibration's part of the summary.
void describe_calibration(const Estimator& estimator, const StartingCalibration& begin,
                          const SessionTotals& totals, const EstimatorOptions& options,
                          SummaryInput* input);

/// What is to be said of a calibration that the drive has not confirmed; empty: it has, or there is
/// none.
[[nodiscard]] std::string verification_message(const SummaryInput& input);

/// summary.json of the session; what goes wrong becomes a message of *faults.
void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals,
                           const SummaryInput& input, std::vector<std::string>* faults);

/// What became of report.html.
struct SessionReport {
  ReportOutcome outcome{};
  std::string failure{};  // why there is none; empty: it is there
};
[[nodiscard]] SessionReport write_session_report(const std::filesystem::path& session);

/// The last words of a session: closing_lines(); quiet, only what must not be missed.
void print_verdict(const SessionReport& report, bool quiet, Progress* progress);

}  // namespace vergence::app
