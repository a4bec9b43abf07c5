#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "core/types/stamped_pose.hpp"

/// Trajectories from files, as body-to-world poses with absolute integer stamps.
///
/// All of them: stamps strictly ascending, at least one pose, rotations normalised. What a file
/// from outside gets wrong is an InputError with file:line that says what is wrong.
namespace vergence::app {

using Trajectory = std::vector<StampedPose>;

/// TUM: `stamp tx ty tz qx qy qz qw`, decimal seconds and metres; `#` begins a comment.
[[nodiscard]] Trajectory read_tum(const std::filesystem::path& file);

/// KITTI odometry: twelve numbers a line, T_world_left row by row; line k belongs to line k of the
/// times file (seconds). Rotations off orthonormal by up to 1e-4 are normalised, others refused.
[[nodiscard]] Trajectory read_kitti(const std::filesystem::path& poses_file,
                                    const std::filesystem::path& times_file);
/// The same with the times in hand. They may go backwards: poses whose time is not later than all
/// before are left out, like their frames.
[[nodiscard]] Trajectory read_kitti(const std::filesystem::path& poses_file,
                                    std::span<const Stamp> times);

/// EuRoC: `state_groundtruth_estimate0/data.csv` (stamp in ns, p, q with w first; further columns
/// are passed over), brought from the body to the left camera: T_R_left = T_R_B · T_BS of the
/// camera's sensor.yaml.
[[nodiscard]] Trajectory read_euroc(const std::filesystem::path& csv_file,
                                    const std::filesystem::path& camera_yaml);

/// Where the truth of a data-set folder lies.
struct TruthFiles {
  enum class Kind { kitti, euroc } kind = Kind::kitti;
  std::filesystem::path poses;   // poses.txt or data.csv
  std::filesystem::path second;  // times.txt, or sensor.yaml of cam0
};

/// KITTI: `poses.txt` and `times.txt` in the folder, or the benchmark's own tree (sequences/NN with
/// poses/NN.txt above).
/// EuRoC: the folder that holds mav0, or mav0. Nothing when the folder has no truth.
[[nodiscard]] std::optional<TruthFiles> find_truth(const std::filesystem::path& folder);

[[nodiscard]] Trajectory read_truth(const TruthFiles& files);

/// What `evaluate` takes: a TUM file, KITTI's poses.txt, EuRoC's data.csv, or a data-set folder of
/// either with its truth. A session folder stands for its trajectory.tum. The second file of KITTI
/// and EuRoC is looked up beside the first.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& path);

}  // namespace vergence::app
