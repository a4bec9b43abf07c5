#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/datasets/stamp_text.hpp"
#include "core/types/stamped_pose.hpp"

/// Trajectories from text files of any program, as body-to-world poses with absolute integer
/// stamps.
///
/// One reader for all. A row is a pose: stamp, x y z and a quaternion, or KITTI's matrix of 3x4 (or
/// 4x4) numbers, with a stamp before it or without. Between the numbers stand blanks, tabs, commas
/// or semicolons; an index may stand before the stamp; further columns are passed over. Headings
/// tell which column is which, where there are some.
///
/// Reads a trajectory: stamps strictly ascending, at least one pose, rotations normalised. Rows
/// with a number that is none (NaN) or a quaternion of zeros are skipped, rows that repeat a stamp
/// dropped, the order of the others is restored; all of that is counted in `remarks`. InputError
/// with file:line: a field that is no number, a quaternion or a matrix that is no rotation, rows
/// that are no poses, times of which most repeat one another.
namespace vergence::app {

using Trajectory = std::vector<StampedPose>;

enum class QuaternionOrder : std::uint8_t { xyzw, wxyz };

struct TrajectoryOptions {
  /// None: detected by the magnitude, or seconds.
  std::optional<TimeUnit> unit{};
  /// None: detected by the headings, or xyzw.
  std::optional<QuaternionOrder> quaternion{};
  /// Option of the user that sets the unit; empty: any interval is accepted.
  std::string_view unit_option{};
};

struct TrajectoryFile {
  Trajectory poses{};
  /// Assumptions, skipped rows and corrections, a phrase each.
  std::vector<std::string> remarks{};
  /// Rows of the file, including skipped ones.
  std::size_t rows = 0;
  /// The file numbers its frames: some may be missing, and `rows` counts them too.
  bool numbered = false;
  /// False: the file holds no times; rows are 0.1 s apart, from 0.
  bool timed = true;
  QuaternionOrder order = QuaternionOrder::xyzw;  // as read
};

/// Reads an argument of `evaluate`: a file or a directory. A session folder: its
/// trajectory.tum; a data set of KITTI or EuRoC: its truth.
///
/// Times of a KITTI file are read from files next to it (times.txt, or the benchmark's tree
/// sequences/NN). The truth of an EuRoC data set, told by its place or its headings, is that of the
/// body: it is brought to the left camera by the cam0/sensor.yaml beside it, T_R_left = T_R_B ·
/// T_BS.
[[nodiscard]] TrajectoryFile read_trajectory_file(const std::filesystem::path& path,
                                                  const TrajectoryOptions& options = {});
/// Reads one file without files next to it.
[[nodiscard]] Trajectory read_tum(const std::filesystem::path& file);

/// KITTI's twelve numbers a line, T_world_left row by row; line k belongs to times[k].
[[nodiscard]] Trajectory read_kitti(const std::filesystem::path& poses_file,
                                    std::span<const Stamp> times);

/// Where the truth of a data-set folder lies.
struct TruthFiles {
  enum class Kind { kitti, euroc } kind = Kind::kitti;
  std::filesystem::path poses;  // poses.txt or data.csv
};

/// KITTI: `poses.txt` and `times.txt` in the folder, or the benchmark's own tree (sequences/NN with
/// poses/NN.txt above); times.txt may be missing where images are counted instead.
/// EuRoC: the folder that holds mav0, or mav0. Nothing when the folder has no truth.
[[nodiscard]] std::optional<TruthFiles> find_truth(const std::filesystem::path& folder);

[[nodiscard]] Trajectory read_truth(const TruthFiles& files);

}  // namespace vergence::app
