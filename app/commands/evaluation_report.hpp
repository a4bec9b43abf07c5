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

/// The figures of an evaluation for a machine. Keys carry their unit; a figure that does not exist
/// is null. With a status other than ok: the counts alone.
[[nodiscard]] nlohmann::ordered_json evaluation_json(const TrajectoryEvaluation& evaluation,
                                                     const EvaluationOptions& options);

/// Formats the evaluation as a table with line ends.
[[nodiscard]] std::string evaluation_text(const TrajectoryEvaluation& evaluation,
                                          const EvaluationOptions& options);

/// Why there are no figures, as a whole message. `interval`: the usual one between the reference's
/// poses. Precondition: the status is not ok.
[[nodiscard]] std::string evaluation_problem(const TrajectoryEvaluation& evaluation,
                                             const EvaluationOptions& options, Duration interval);
/// That most poses lie in holes of the reference, and what bridges them; empty: they do not.
[[nodiscard]] std::string gap_remark(const TrajectoryEvaluation& evaluation,
                                     const EvaluationOptions& options, Duration interval);

/// INS extrinsics used if none are estimated.
struct InsMount {
  Transform T_ins_left{};
  // Where the extrinsics were read.
  std::string source{};
  // True if the extrinsics are unknown: the camera looks along the INS's x axis, at its origin.
  bool axes_only = false;
};

/// The mount that the sessions around these files or folders compared with, of the first that has
/// one in its summary.json; else the axes alone.
[[nodiscard]] InsMount load_ins_mount(const std::filesystem::path& estimate,
                                      const std::filesystem::path& readings);

/// For a person, a line with its end.
[[nodiscard]] std::string ins_mount_text(const InsMount& mount);

/// The mount between two trajectories' bodies; the drawing it is told against is the nearest of:
/// the same axes, forward-left-up against a camera's, and the reverse. Not ok: a status only.
struct FoundMount {
  MountStatus status = MountStatus::too_few;
  Mount mount{};
  Mat3 nominal = Mat3::Identity();
  // True if the reference is an INS and the estimate a camera: the result is then what the
  // configuration calls INS-to-camera extrinsics.
  bool of_ins = false;
};
[[nodiscard]] FoundMount find_mount(const Trajectory& estimate, const Trajectory& reference);

/// The readings of an INS in the east-north-up axes at the first place among them: those with an
/// attitude and a place that satellites gave, velocities where told.
[[nodiscard]] std::vector<MountReference> ins_moments(std::span<const InsRecord> readings);
/// The mount of the left camera in an INS's body, told against a camera that looks along the INS's
/// x with its x to the right.
[[nodiscard]] FoundMount find_ins_mount(const Trajectory& estimate,
                                        std::span<const MountReference> moments);
/// The poses of the moments.
[[nodiscard]] Trajectory poses_of(std::span<const MountReference> moments);

/// The reference brought to the estimate's body. Stamps stay: a clock offset is told, not applied.
[[nodiscard]] Trajectory brought_over(const Trajectory& reference, const Transform& T_ref_est);

/// For a machine; what is not observable is null, with its sigma beside it.
[[nodiscard]] nlohmann::ordered_json mount_json(const FoundMount& found);
/// Why there is none, a few words. Precondition: the status is not ok.
[[nodiscard]] const char* mount_problem(MountStatus status);
/// For a person, lines with their ends. Precondition: the status is ok.
[[nodiscard]] std::string mount_text(const FoundMount& found);

}  // namespace vergence::app
