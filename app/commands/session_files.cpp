#include "app/commands/session_files.hpp"

#include <cstring>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/config/calibration_file.hpp"
#include "app/recorder/line_file.hpp"
#include "app/report/report.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/thread_runner.hpp"

namespace vergence::app {

std::unique_ptr<PairRunner> make_runner(int threads) {
  if (threads >= 2) return std::make_unique<ThreadRunner>();
  return std::make_unique<SequentialRunner>();
}

void write_session_calibration(const std::filesystem::path& session, const RigCalibration& rig, const std::string& rig_name,
                               std::vector<std::string>* faults) {
  CalibrationFile file;
  file.rig = rig;
  file.rig_name = rig_name;
  file.source = "given";
  try {
    write_calibration(session / "calibration.yaml", file);
  } catch (const InputError& e) {
    faults->emplace_back(e.what());
  }
}

void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals, const SummaryInput& input,
                           std::vector<std::string>* faults) {
  const std::string text = summary_json(totals, input).dump(2) + "\n";
  try {
    LineFile file(session / "summary.json");
    (void)file.append(text);
    if (!file.close()) faults->push_back(file.path().string() + ": is not complete (" + std::strerror(file.fault()) + ")");
  } catch (const InputError& e) {
    faults->emplace_back(e.what());
  }
}

void write_session_report(const std::filesystem::path& session, bool quiet, Progress* progress) {
  try {
    const ReportOutcome outcome = write_report(session);
    if (!quiet) progress->say(fmt::format("report {}: {}", outcome.page.string(), outcome.headline));
  } catch (const InputError& e) {
    progress->say(std::string("vergence: ") + e.what());
  }
}

void print_memory_table(const std::vector<std::pair<std::string, std::size_t>>& memory) {
  std::size_t sum = 0;
  for (const auto& [what, bytes] : memory) {
    std::cout << fmt::format("{:<24}{:>14}\n", what, bytes);
    sum += bytes;
  }
  std::cout << fmt::format("{:<24}{:>14}\n", "sum_bytes", sum) << std::flush;
}

}  // namespace vergence::app
