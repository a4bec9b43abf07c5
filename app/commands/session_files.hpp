#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/recorder/summary.hpp"
#include "app/runtime/progress.hpp"
#include "core/types/parallel.hpp"

/// What every command that writes a session folder does alike.
namespace vergence::app {

/// What an arena needs beside its contents: the first piece is aligned, too.
[[nodiscard]] constexpr std::size_t arena_size(std::size_t bytes) { return bytes + 64; }

/// One worker beside the estimator with two threads or more.
[[nodiscard]] std::unique_ptr<PairRunner> make_runner(int threads);

/// calibration.yaml of the session; what goes wrong becomes a sentence of *faults.
void write_session_calibration(const std::filesystem::path& session, const RigCalibration& rig, const std::string& rig_name,
                               std::vector<std::string>* faults);

/// summary.json of the session; what goes wrong becomes a sentence of *faults.
void write_session_summary(const std::filesystem::path& session, const SessionTotals& totals, const SummaryInput& input,
                           std::vector<std::string>* faults);

/// report.html of the session, and a line that says where it is and what it says; what goes wrong is said, too.
void write_session_report(const std::filesystem::path& session, bool quiet, Progress* progress);

/// The table of --memory, on stdout.
void print_memory_table(const std::vector<std::pair<std::string, std::size_t>>& memory);

}  // namespace vergence::app
