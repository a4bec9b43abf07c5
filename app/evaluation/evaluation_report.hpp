#pragma once
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "core/comparison/trajectory_metrics.hpp"

namespace vergence::app {

/// The figures of an evaluation for a machine. Keys carry their unit; a figure that does not exist
/// is null. With a status other than ok: the counts alone.
[[nodiscard]] nlohmann::ordered_json evaluation_json(const TrajectoryEvaluation& evaluation,
                                                     const EvaluationOptions& options);

/// The same as a table for a person, lines with their ends.
[[nodiscard]] std::string evaluation_text(const TrajectoryEvaluation& evaluation,
                                          const EvaluationOptions& options);

/// Why there are no figures, as a whole sentence. Precondition: the status is not ok.
[[nodiscard]] std::string evaluation_problem(const TrajectoryEvaluation& evaluation,
                                             const EvaluationOptions& options);

}  // namespace vergence::app
