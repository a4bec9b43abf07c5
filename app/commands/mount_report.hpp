#pragma once
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "app/datasets/trajectory_files.hpp"
#include "core/comparison/mount.hpp"

namespace vergence::app {

/// The mount between two trajectories' bodies; the drawing it is told against is the nearest of: the same axes, forward-left-up against a
/// camera's, and the reverse. Not ok: a status only.
struct FoundMount {
  MountStatus status = MountStatus::too_few;
  Mount mount{};
  Mat3 nominal = Mat3::Identity();
};
[[nodiscard]] FoundMount find_mount(const Trajectory& estimate, const Trajectory& reference);

/// The reference brought to the estimate's body by what is observable of the mount, the rest by the drawing. Stamps stay: the clock offset
/// is told, not applied.
[[nodiscard]] Trajectory brought_over(const Trajectory& reference, const Mount& mount);

/// For a machine; what is not observable is null, with its sigma beside it.
[[nodiscard]] nlohmann::ordered_json mount_json(const FoundMount& found);
/// For a person, lines with their ends.
[[nodiscard]] std::string mount_text(const FoundMount& found);

}  // namespace vergence::app
