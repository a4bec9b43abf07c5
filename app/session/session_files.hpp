#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/config/calibration_file.hpp"
#include "app/report/report.hpp"
#include "app/runtime/progress.hpp"
#include "app/session/recorder.hpp"
#include "app/session/session_observer.hpp"
#include "app/session/starting_calibration.hpp"
#include "app/session/summary.hpp"
#include "core/types/parallel.hpp"

/// Shared steps of commands that write a session directory.
namespace vergence::app {

/// Creates a session's directory, or accepts an empty one. InputError: it exists and is not empty,
/// or is no folder.
bool check_session_folder(const std::filesystem::path& folder);
/// Makes the folder of a session. False: it was there, empty. InputError: it exists and is not
/// empty, is no folder, or cannot be made.
bool make_session_folder(const std::filesystem::path& folder);
/// Undoes make_session_folder(): removes what is in the folder, and with `made` the folder itself.
void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept;

/// Size of an arena including the alignment of its first piece.
[[nodiscard]] constexpr std::size_t arena_size(std::size_t bytes) { return bytes + 64; }

/// One worker beside the estimator with two threads or more.
[[nodiscard]] std::unique_ptr<PairRunner> make_runner(int threads);

/// calibration.yaml of the session; what goes wrong becomes a message of *faults.
void write_session_calibration(const std::filesystem::path& session,
                               const CalibrationFile& calibration,
                               std::vector<std::string>* faults);

/// Writes a calibration found online: calibration.yaml of the session
/// at once, so that a session that is killed has it, and the state file, if there is to be one. One
/// that the drive began with and has confirmed goes to the state file alone.
/// `words`: names and serials of the cameras, what the configuration says, and where the first is
/// from.
[[nodiscard]] KeepCalibration calibration_keeper(const std::filesystem::path& session,
                                                 const CalibrationFile& words,
                                                 const std::optional<std::filesystem::path>& state);

/// The session's first files: calibrations.csv and calibration.yaml have what the drive begins
/// with, if there is anything.
void begin_session(const std::filesystem::path& session, const StartingCalibration& begin,
                   Stamp stamp, SessionOutput* output, std::vector<std::string>* faults);

/// The calibration's part of the summary.
void describe_calibration(const Estimator& estimator, const StartingCalibration& begin,
                          const SessionTotals& totals, const EstimatorOptions& options,
                          SummaryInput* input);

/// Returns the message about an unverified calibration; empty if it is verified or there is
/// none.
[[nodiscard]] std::string verification_message(const SummaryInput& input);

/// calibration.yaml as it is in use at the end, if there is one. A message of *faults that
/// calibration.yaml could not be written at the start gives way to what becomes of it now.
void end_session(const std::filesystem::path& session, const StartingCalibration& begin,
                 const SummaryInput& input, const SessionTotals& totals,
                 std::vector<std::string>* faults);

/// summary.json of the session; what goes wrong becomes a message of *faults.
void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals,
                           const SummaryInput& input, std::vector<std::string>* faults);

/// Result of writing report.html.
struct SessionReport {
  ReportOutcome outcome{};
  std::string failure{};  // why there is none; empty: it is there
};
[[nodiscard]] SessionReport write_session_report(const std::filesystem::path& session);

/// The last words of a session: closing_lines(); quiet, only what must not be missed.
void print_verdict(const SessionReport& report, bool quiet, Progress* progress);

}  // namespace vergence::app
