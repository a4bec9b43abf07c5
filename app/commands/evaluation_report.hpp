#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "app/session/ins_file.hpp"
#include "core/comparison/mount.hpp"
#include "core/comparison/trajectory_metrics.hpp"
#include "core/math/se3.hpp"

namespace vergence::app {

/// Results of an evaluation as JSON. Keys carry their unit; missing values are null. If the status
/// is not ok, only the counts.
[[nodiscard]] nlohmann::ordered_json evaluation_json(const TrajectoryEvaluation& evaluation,
                                                     const EvaluationOptions& options);

/// Formats the evaluation as a table with line ends.
[[nodiscard]] std::string evaluation_text(const TrajectoryEvaluation& evaluation,
                                          const EvaluationOptions& options);

/// Message about why there are no results. `interval` is the usual one of the reference's poses.
/// Precondition: the status is not ok.
[[nodiscard]] std::string evaluation_problem(const TrajectoryEvaluation& evaluation,
                                             const EvaluationOptions& options, Duration interval);
/// Remark that most poses are in gaps of the reference, and how to bridge them; empty if not.
[[nodiscard]] std::string gap_remark(const TrajectoryEvaluation& evaluation,
                                     const EvaluationOptions& options, Duration interval);

/// INS extrinsics used if none are estimated.
struct InsMount {
  Transform T_ins_left{};
  /// Origin of the values.
  std::string source{};
  /// True if the extrinsics are unknown: a camera along the INS's x axis, at its origin.
  bool axes_only = false;
};

/// INS extrinsics used by the sessions of these files or directories, the first in a summary.json;
/// else the axes only.
[[nodiscard]] InsMount load_ins_mount(const std::filesystem::path& estimate,
                                      const std::filesystem::path& readings);

/// INS extrinsics as JSON, in the format of summary.json.
[[nodiscard]] nlohmann::ordered_json ins_mount_json(const InsMount& mount);
/// INS extrinsics as a line of text.
[[nodiscard]] std::string ins_mount_text(const InsMount& mount);

/// Estimated extrinsics between the bodies of two trajectories, relative to the nearest nominal
/// axes: equal, forward-left-up against a camera's, or the reverse. If not ok, only the status is
/// valid.
struct FoundMount {
  MountStatus status = MountStatus::too_few;
  Mount mount{};
  Mat3 nominal = Mat3::Identity();
  /// True if the reference is an INS and the estimate a camera, so that the result is the
  /// configuration's INS extrinsics.
  bool of_ins = false;
};
[[nodiscard]] FoundMount find_mount(const Trajectory& estimate, const Trajectory& reference);

/// INS samples with attitude and GNSS position, in east-north-up axes at the first position, with
/// velocities if present.
[[nodiscard]] std::vector<MountReference> ins_moments(std::span<const InsRecord> readings);
/// Extrinsics of the left camera in an INS's body, relative to a camera that looks along the INS's
/// x axis.
[[nodiscard]] FoundMount find_ins_mount(const Trajectory& estimate,
                                        std::span<const MountReference> moments);
/// Poses of the moments.
[[nodiscard]] Trajectory poses_of(std::span<const MountReference> moments);

/// Reference transformed to the estimate's body. Stamps are unchanged: a clock offset is reported,
/// not applied.
[[nodiscard]] Trajectory brought_over(const Trajectory& reference, const Transform& T_ref_est);

/// Extrinsics as JSON; unobservable values are null, next to their sigma.
[[nodiscard]] nlohmann::ordered_json mount_json(const FoundMount& found);
/// Short reason for a missing estimate. Precondition: the status is not ok.
[[nodiscard]] const char* mount_problem(MountStatus status);
/// Extrinsics as lines of text. Precondition: the status is ok.
[[nodiscard]] std::string mount_text(const FoundMount& found);

}  // namespace vergence::app
