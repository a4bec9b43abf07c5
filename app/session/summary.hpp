#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "app/session/ins_comparison.hpp"
#include "app/session/session_totals.hpp"
#include "core/calibration/options.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/types/calibration.hpp"

namespace vergence::app {

/// Metrics of the simulated rig: trajectory and calibration against the ground truth.
struct TruthMetrics {
  std::optional<TrajectoryEvaluation> evaluation;
  /// Errors of cameras 1 and up in the final calibration: rotation vector, rad;
  /// translation, m; ours against the true one.
  std::vector<std::array<double, 6>> calibration_error{};
};

/// Heap allocations by the name of the thread that made them, from the first frame that is
/// delivered until the last (docs/deployment.md).
struct ThreadAllocationCounts {
  std::vector<std::pair<std::string, std::uint64_t>> ours{};       // 0 where a thread made none
  std::vector<std::pair<std::string, std::uint64_t>> libraries{};  // of threads that libraries have
};

/// Input of summary.json in addition to the recorder's totals.
struct SummaryInput {
  std::uint64_t skipped = 0;               // frames that were not read: torn, missing, out of time
  std::uint64_t dropped_by_estimator = 0;  // points and observations over capacity
  std::optional<TrajectoryEvaluation>
      evaluation;                  // against the reference, by summary_evaluation_options()
  bool calibrated = true;          // false: no calibration has been found
  RigCalibration calibration;      // in use at the end
  std::string calibration_source;  // where it comes from
  bool online = true;     // the rig was watched; false: nothing could confirm a calibration
  bool verified = false;  // the drive itself has confirmed the calibration in use at the end
  std::optional<RigCalibration> before{};     // the drive began with it; none: from scratch
  calibration::CalibrationOptions options{};  // what its words mean
  std::uint64_t runtime_allocations = 0;
  Duration frame_budget{};  // zero: none
  ThreadAllocationCounts allocations{};
  std::vector<std::pair<std::string, std::size_t>> memory;  // bytes by what holds them
  std::string configuration_hash;
  std::vector<std::pair<std::string, std::uint64_t>>
      devices{};  // counters of the devices and of the pairing; none in a replay
  std::vector<std::pair<std::string, std::uint64_t>>
      comparison{};                   // counters of the comparison with an INS
  std::optional<EnuMetrics> earth{};  // with an INS
  std::optional<TruthMetrics> truth{};
  std::vector<std::string> assumptions{};  // about the recording that was read
  nlohmann::ordered_json time{};           // how time was over a live drive; null in a replay
};

/// Options of the metrics in summary.json: segments of 100–800 m (step 10), 10–50 m
/// (step 1), and these once more after one scale.
[[nodiscard]] EvaluationOptions summary_evaluation_options();

/// Error of a calibration against the true one: rotation vector, rad, and translation, m, that lead
/// from the true transform of each further camera to ours (left perturbation).
[[nodiscard]] std::vector<std::array<double, 6>> calibration_errors(const RigCalibration& ours,
                                                                    const RigCalibration& truth);

/// summary.json (DESIGN §6), keys in a fixed order; what does not exist is null.
[[nodiscard]] nlohmann::ordered_json summary_json(const SessionTotals& totals,
                                                  const SummaryInput& input);

}  // namespace vergence::app
