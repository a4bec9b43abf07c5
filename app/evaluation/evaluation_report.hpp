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

/// Why there are no figures, as a whole sentence. `interval`: the usual one between the reference's
/// poses. Precondition: the status is not ok.
[[nodiscard]] std::string evaluation_problem(const TrajectoryEvaluation& evaluation,
                                             const EvaluationOptions& options, Duration interval);
/// That most poses lie in holes of the reference, and what bridges them; empty: they do not.
[[nodiscard]] std::string gap_remark(const TrajectoryEvaluation& evaluation,
                                     const EvaluationOptions& options, Duration interval);

}  // namespace vergence::app
