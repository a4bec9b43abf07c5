#pragma once
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "app/session/ins_file.hpp"
#include "core/comparison/mount.hpp"

namespace vergence::app {

/// The mount between two trajectories' bodies; the drawing it is told against is the nearest of:
/// the same axes, forward-left-up against a camera's, and the reverse. Not ok: a status only.
struct FoundMount {
  MountStatus status = MountStatus::too_few;
  Mount mount{};
  Mat3 nominal = Mat3::Identity();
  bool of_ins = false;  // the reference is an INS and the estimate a camera: what is found is what
                        // the configuration calls the mount
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
