#pragma once
#include <array>
#include <filesystem>
#include <optional>

#include "app/datasets/trajectory_files.hpp"
#include "app/runtime/errors.hpp"
#include "core/comparison/trajectory_metrics.hpp"

namespace vergence::app {

/// `vergence evaluate`.
struct EvaluationRequest {
  std::filesystem::path estimate;
  std::filesystem::path reference;  // empty: the estimate's session has an INS
  EvaluationOptions options{};
  bool usual_lengths = true;  // of options.segments the longest that the path is long enough for
  bool json = false;
  bool estimate_ins_extrinsics = false;
  // Requested time units of the estimate's and the reference's file.
  std::array<std::optional<TimeUnit>, 2> units{};
  std::array<std::optional<QuaternionOrder>, 2> quaternions{};
};

/// Compares, and prints the figures on standard output.
/// → done, not_usable (nothing to compare, no mount)
/// Errors  InputError: files that are not there or cannot be read.
[[nodiscard]] ExitCode run_evaluation(const EvaluationRequest& request);

}  // namespace vergence::app
