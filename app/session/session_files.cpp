#include "app/session/session_files.hpp"

#include <nlohmann/json.hpp>

#include "app/runtime/background_thread.hpp"
#include "app/runtime/durable_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/terminal_text.hpp"

namespace vergence::app {

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

std::string verification_message(const SummaryInput& input) {
  if (input.verified || !input.calibrated) return "";
  if (!input.online) return "the calibration is not verified: calibration.online is off";
  return "the calibration was never verified; drive turns past near objects, with tracks in the "
         "image corners";
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
    // The outcome keeps its default.
    report.failure = e.what();
  }
  return report;
}

void print_verdict(const SessionReport& report, bool quiet, Progress* progress) {
  if (!quiet) {
    // Number of columns.
    constexpr std::size_t kWidth = 110;
    for (const std::string& message : closing_lines(report.outcome, report.failure)) {
      std::string text;
      for (const std::string& line : wrapped(message, kWidth))
        text += (text.empty() ? "" : "\n  ") + line;
      progress->print(text);
    }
    return;
  }
  if (!report.failure.empty()) progress->print("vergence: " + report.failure);
  if (!report.outcome.assessment.usable)
    progress->print("vergence: do not use these poses: " + report.outcome.assessment.main_reason);
}

}  // namespace vergence::app
