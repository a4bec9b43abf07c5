#pragma once
#include "app/datasets/trajectory_files.hpp"
#include "app/runtime/errors.hpp"
#include "core/comparison/trajectory_metrics.hpp"

namespace vergence::app {

/// Arguments of `vergence evaluate`.
struct EvaluationRequest {
  std::filesystem::path estimate;
  /// Empty if the estimate's session has an INS.
  std::filesystem::path reference;
  EvaluationOptions options{};
  /// Uses the longest of options.segments that fit into the path.
  bool usual_lengths = true;
  bool json = false;
  bool estimate_ins_extrinsics = false;
  // Time units of the estimate's and the reference's file.
  std::array<std::optional<TimeUnit>, 2> units{};
  std::array<std::optional<QuaternionOrder>, 2> quaternions{};
};

/// Compares and prints the results on standard output. Returns done, or not_usable (nothing to
/// compare, no extrinsics). Throws InputError for missing or unreadable files.
[[nodiscard]] ExitCode run_evaluation(const EvaluationRequest& request);

}  // namespace vergence::app
