#include "app/session/session_files.hpp"

#include <system_error>

#include <nlohmann/json.hpp>

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

std::string verification_sentence(const SummaryInput& input) {
  if (input.verified || !input.calibrated) return "";
  if (!input.online)
    return "the calibration is not verified: nothing watched it (calibration.online: off)";
  return "the drive has not confirmed its calibration; what would: turns, near structure at the "
         "roadside, tracks in the images' corners";
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

void say_verdict(const SessionReport& report, bool quiet, Progress* progress) {
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
