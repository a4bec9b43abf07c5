#include "app/session/session_files.hpp"

#include <cstring>
#include <string>
#include <system_error>

#include <nlohmann/json.hpp>

#include "app/config/calibration_file.hpp"
#include "app/config/calibration_state.hpp"
#include "app/runtime/background_thread.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {

bool check_session_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const std::string name = folder.string();
  if (name.empty()) throw InputError("--out is empty; name a folder for the session");
  std::error_code error;
  if (!fs::exists(folder, error)) return false;
  if (!fs::is_directory(folder, error))
    throw InputError(name +
                     ": is not a folder; name a new or empty one for the session with --out");
  const bool empty = fs::is_empty(folder, error);
  if (error)
    throw InputError(name + ": cannot be looked into (" + error.message() +
                     "): check its permissions");
  if (!empty)
    throw InputError(
        name +
        ": is not empty, and nothing is ever overwritten; name a new or empty folder with --out");
  return true;
}

bool make_session_folder(const std::filesystem::path& folder) {
  if (check_session_folder(folder)) return false;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw InputError(folder.string() + ": cannot be made (" + error.message() +
                     "): check that disk and the folder above it");
  return true;
}

void discard_session_folder(const std::filesystem::path& folder, bool made) noexcept {
  namespace fs = std::filesystem;
  std::error_code error;
  if (made) {
    fs::remove_all(folder, error);
    return;
  }
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    fs::remove_all(entry->path(), ignored);
  }
}

std::unique_ptr<PairRunner> make_runner(int threads) {
  if (threads >= 2) return std::make_unique<ThreadRunner>();
  return std::make_unique<SequentialRunner>();
}

void write_session_calibration(const std::filesystem::path& session,
                               const CalibrationFile& calibration,
                               std::vector<std::string>* faults) {
  try {
    write_calibration(session / "calibration.yaml", calibration);
  } catch (const InputError& e) {
    faults->emplace_back(e.what());
  }
}

namespace {

Kept keep_state(const std::filesystem::path& state, const CalibrationFile& file) {
  try {
    write_state(state, file);
    return {false, "the calibration is kept for the next drive: " + state.string()};
  } catch (const InputError& e) {
    return {true, std::string(e.what()) + "; the next drive will not know this calibration"};
  }
}

}  // namespace

KeepCalibration calibration_keeper(const std::filesystem::path& session,
                                   const CalibrationFile& words,
                                   const std::optional<std::filesystem::path>& state) {
  return [session, words, state](const RigCalibration& rig, bool found) -> Kept {
    CalibrationFile file = words;
    file.rig = rig;
    if (found) file.source = "online";
    std::vector<std::string> of_session;
    if (found) write_session_calibration(session, file, &of_session);
    Kept kept{!of_session.empty(), {}};
    if (state) kept = keep_state(*state, file);
    // The session's own is written again at its end.
    for (const std::string& fault : of_session)
      kept.message += (kept.message.empty() ? "" : "; ") + fault;
    return kept;
  };
}

namespace {

/// Takes out the messages of one file, which begin with its name.
void clear_faults_of(const std::filesystem::path& file, std::vector<std::string>* faults) {
  const std::string name = file.string() + ":";
  std::erase_if(*faults, [&name](const std::string& fault) { return fault.starts_with(name); });
}

}  // namespace

void begin_session(const std::filesystem::path& session, const StartingCalibration& begin,
                   Stamp stamp, SessionOutput* output, std::vector<std::string>* faults) {
  if (begin.trust == CalibrationTrust::none) return;
  output->post(CalibrationRecord::begin(begin.file.rig, stamp, begin.cause, begin.source));
  write_session_calibration(session, begin.file,
                            faults);  // at once: a session that is killed has it, too
}

void describe_calibration(const Estimator& estimator, const StartingCalibration& begin,
                          const SessionTotals& totals, const EstimatorOptions& options,
                          SummaryInput* input) {
  input->calibrated = estimator.calibrated();
  input->online = options.online;
  input->verified = options.online && estimator.verified();
  input->calibration = estimator.calibration();
  input->calibration_source = totals.accepted > 0 ? "online" : begin.source;
  if (begin.trust != CalibrationTrust::none) input->before = begin.file.rig;
  input->options = options.calibration;
}

std::string verification_message(const SummaryInput& input) {
  if (input.verified || !input.calibrated) return "";
  if (!input.online)
    return "the calibration is not verified: nothing watched it (calibration.online: off)";
  return "the drive has not confirmed its calibration; what would: turns, near structure at the "
         "roadside, tracks in the images' corners";
}

void end_session(const std::filesystem::path& session, const StartingCalibration& begin,
                 const SummaryInput& input, const SessionTotals& totals,
                 std::vector<std::string>* faults) {
  if (!input.calibrated) return;
  CalibrationFile file = begin.file;
  file.rig = input.calibration;
  if (totals.accepted > 0) file.source = "online";
  clear_faults_of(session / "calibration.yaml", faults);
  write_session_calibration(session, file, faults);
}

void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals,
                           const SummaryInput& input, std::vector<std::string>* faults) {
  // Names of files need not be UTF-8.
  const std::string text =
      summary_json(totals, input).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
      "\n";
  try {
    replace_durably(session / "summary.json", text);
  } catch (const InputError& e) {
    faults->emplace_back(e.what());
  }
}

SessionReport write_session_report(const std::filesystem::path& session) {
  SessionReport report;
  try {
    report.outcome = write_report(session);
  } catch (const InputError& e) {
    report.failure = e.what();  // the outcome says usable: nobody knows better
  }
  return report;
}

void print_verdict(const SessionReport& report, bool quiet, Progress* progress) {
  if (!quiet) {
    for (const std::string& line : closing_lines(report.outcome, report.failure))
      progress->say(line);
    return;
  }
  if (!report.failure.empty()) progress->say("vergence: " + report.failure);
  if (!report.outcome.usable)
    progress->say("vergence: do not use these poses: " + report.outcome.main_reason);
}

}  // namespace vergence::app
