#pragma once

#include "app/datasets/times_file.hpp"
#include "core/types/stamped_pose.hpp"

/// Trajectories from text files of any program, as body-to-world poses with absolute integer
/// stamps.
///
/// A row is a pose: stamp, x y z and a quaternion, or KITTI's 3x4 (or 4x4) matrix with or without a
/// stamp. Separators are blanks, tabs, commas or semicolons; an index may precede the stamp;
/// further columns are ignored. Headings, if any, identify the columns.
///
/// Results have strictly increasing stamps, at least one pose and normalised rotations. Rows with
/// NaN or a zero quaternion and repeated stamps are dropped, others sorted; `remarks` has the
/// counts. Throws InputError with file:line for an invalid number or rotation, rows that are no
/// poses, or mostly repeated times.
namespace vergence::app {

using Trajectory = std::vector<StampedPose>;

enum class QuaternionOrder : std::uint8_t { xyzw, wxyz };

struct TrajectoryOptions {
  /// Empty: detected by the magnitude, or seconds.
  std::optional<TimeUnit> unit{};
  /// Empty: detected by the headings, or xyzw.
  std::optional<QuaternionOrder> quaternion{};
  /// Option of the user that sets the unit; empty: any interval is accepted.
  std::string_view unit_option{};
  /// Times of the rows of a file without times; if empty, they are read from files next to it.
  std::span<const Stamp> times{};
};

struct TrajectoryFile {
  Trajectory poses{};
  /// Assumptions, skipped rows and corrections, a phrase each.
  std::vector<std::string> remarks{};
  /// Rows of the file, including skipped ones.
  std::size_t rows = 0;
  /// True if the file numbers its frames: some may be missing, and `rows` counts them too.
  bool numbered = false;
  /// False if the file has no times; rows are then 0.1 s apart, from 0.
  bool timed = true;
  // Order that was read.
  QuaternionOrder order = QuaternionOrder::xyzw;
};

/// Reads an argument of `evaluate`: a file or a directory. For a session that is its
/// trajectory.tum, for a KITTI or EuRoC data set its ground truth.
///
/// Times of a KITTI file are read from files next to it (times.txt, or the benchmark's tree
/// sequences/NN). EuRoC's ground truth, detected by its path or headings, is that of the body; it
/// is transformed to the left camera by the cam0/sensor.yaml next to it, T_R_left = T_R_B · T_BS.
[[nodiscard]] TrajectoryFile read_trajectory_file(const std::filesystem::path& path,
                                                  const TrajectoryOptions& options = {});
/// Reads one file without files next to it.
[[nodiscard]] Trajectory read_tum(const std::filesystem::path& file);

/// Ground truth of a data set. KITTI: `poses.txt` in the directory, or the benchmark's tree
/// (sequences/NN with poses/NN.txt above). EuRoC: data.csv in the directory with mav0, or in mav0.
/// Empty without ground truth.
[[nodiscard]] std::optional<std::filesystem::path> find_truth(const std::filesystem::path& folder);

}  // namespace vergence::app
