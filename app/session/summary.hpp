#pragma once
#include <map>

#include <nlohmann/json.hpp>

#include "app/session/ins_comparison.hpp"
#include "app/session/session_totals.hpp"
#include "core/calibration/options.hpp"
#include "core/comparison/trajectory_metrics.hpp"

namespace vergence::app {

/// Metrics of the simulated rig: trajectory and calibration against the ground truth.
struct TruthMetrics {
  std::optional<TrajectoryEvaluation> evaluation;
  /// Errors of cameras 1 and up in the final calibration: rotation vector, rad;
  /// translation, m; estimate against the true one.
  std::vector<std::array<double, 6>> calibration_error{};
};

/// Heap allocations by the name of the thread that made them, from the first frame that is
/// delivered until the last (docs/deployment.md).
struct ThreadAllocationCounts {
  /// Counts of the program's threads, also those with 0.
  std::map<std::string, std::uint64_t> own{};
  /// Counts of the libraries' threads.
  std::map<std::string, std::uint64_t> libraries{};
};

/// Percentiles and maximum of times, in ms to the microsecond.
[[nodiscard]] nlohmann::ordered_json distribution_json(const TimeHistogram& times);

/// Input of summary.json in addition to the recorder's totals.
struct SummaryInput {
  /// Frames that were not used: incomplete, missing or with an implausible stamp.
  std::uint64_t skipped = 0;
  /// Points and observations dropped for lack of capacity.
  std::uint64_t dropped_by_estimator = 0;
  /// Evaluation against the reference, with summary_evaluation_options().
  std::optional<TrajectoryEvaluation> evaluation{};
  /// False if no calibration was found.
  bool calibrated = true;
  /// Calibration in use at the end.
  RigCalibration calibration{};
  /// Origin of that calibration.
  std::string calibration_source{};
  /// True if the rig was monitored; without monitoring a calibration cannot be verified.
  bool online = true;
  /// True if the calibration in use at the end is verified.
  bool verified = false;
  /// Initial calibration; none if from scratch.
  std::optional<RigCalibration> before{};
  /// Options that define the calibration rating.
  calibration::CalibrationOptions options{};
  std::uint64_t runtime_allocations = 0;
  /// Zero if there is no budget.
  Duration frame_budget{};
  ThreadAllocationCounts allocations{};
  /// Bytes by component.
  std::vector<std::pair<std::string, std::size_t>> memory{};
  std::string configuration_hash{};
  /// Counters of the devices and of the pairing; none in a replay.
  std::vector<std::pair<std::string, std::uint64_t>> devices{};
  /// Counters of the comparison with an INS.
  std::vector<std::pair<std::string, std::uint64_t>> comparison{};
  /// Null without an INS.
  nlohmann::ordered_json enu{};
  std::optional<TruthMetrics> truth{};
  /// Assumptions about the recording.
  std::vector<std::string> assumptions{};
  /// Timing statistics of a live run; null in a replay.
  nlohmann::ordered_json time{};
};

/// Options of the metrics in summary.json: segments of 100–800 m (step 10), 10–50 m
/// (step 1), and these once more after one scale.
[[nodiscard]] EvaluationOptions summary_evaluation_options();

/// Prints the absolute and the relative error, if there is a reference; `reference` is its name.
void print_evaluation(const char* reference, const std::optional<TrajectoryEvaluation>& evaluation,
                      Progress* progress);

/// Error of a calibration against the true one: rotation vector in rad and translation in m, which
/// lead from the true transform of each camera k ≥ 1 to the estimated one (left perturbation).
[[nodiscard]] std::vector<std::array<double, 6>> calibration_errors(const RigCalibration& estimate,
                                                                    const RigCalibration& truth);

/// Content of summary.json with a fixed order of keys; missing values are null.
[[nodiscard]] nlohmann::ordered_json summary_json(const SessionTotals& totals,
                                                  const SummaryInput& input);

}  // namespace vergence::app
