#pragma once
#include <cstddef>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "app/datasets/trajectory_files.hpp"
#include "core/types/pose_sample.hpp"

/// Definition of a wrong `ok` pose, one definition for recorded drives and for the mock's faults.
///
/// A pose is wrong when the motion over the last kIntegrityFrames frames, its way or its turn, is
/// off by more than kHonestyTimes what is normal: what the untouched drive is off by over as long a
/// time, on its mean or around the same place, whichever is more. Corners are several times harder
/// than the rest: a focal length that is off turns every corner too far. Less than `ok` claims is
/// never wrong: the depths of a calibration that was found in the drive are verified to 2 %
/// (max_depth_error_percent), and so are the lengths of its motions.
namespace vergence::test {

// The first poses have fewer frames.
inline constexpr std::size_t kIntegrityFrames = 20;
/// Frames of the untouched drive that what is normal is known over: those between 20 of a drive
/// that has every third.
inline constexpr std::size_t kLongestNormal = 3 * kIntegrityFrames;
inline constexpr double kHonestyTimes = 5;
/// A turn that is normal at least, rad: five times it are a tenth of a degree.
inline constexpr double kMinNormalTurn = 0.02 * std::numbers::pi / 180;

/// The true pose nearest in time; null beyond half of EuRoC's interval of truth. Valid as long as
/// `truth`.
[[nodiscard]] const Transform* true_pose(const app::Trajectory& truth, Stamp stamp);

/// An error of the way that is normal at least, as a share of it: five times it are 2 %.
inline constexpr double kMinNormalShift = 0.004;

struct EvaluatedPose {
  Stamp stamp{};
  PoseStatus status = PoseStatus::lost;
  Transform T_world_left{};
};

struct MotionError {
  double shift_m = 0, turn_rad = 0;
  /// Length of the true motion.
  double length_m = 0;
};
/// Mean error of the motion by the number of frames that it is over; of poses that are not `lost`
/// and whose truth is known.
using NormalErrors = std::array<MotionError, kLongestNormal + 1>;
[[nodiscard]] NormalErrors normal_errors(std::span<const EvaluatedPose> poses,
                                         const app::Trajectory& truth);

/// Normal error of the motion between two times of the drive.
using NormalError = std::function<MotionError(Stamp from, Stamp to)>;
/// Error of the unperturbed drive, over as many of its frames as there are between them: the mean
/// or that of the motions that end within a second of `to`, whichever is more.
[[nodiscard]] NormalError normal_error_there(std::vector<EvaluatedPose> poses,
                                             app::Trajectory truth);

struct Integrity {
  int ok = 0, lost = 0;
  // Number of `ok` poses that are wrong over their frames since the last pose not `ok`.
  int wrong = 0;
  // Number of `ok` poses that are wrong over their frames since the last `lost` pose.
  int wrong_over_all = 0;
  // Number of `ok` poses without ground truth at their stamp or at that of the first pose.
  int not_evaluated = 0;
  // Index of the first wrong pose, its error, and the number of frames of the error.
  std::size_t first_wrong = 0;
  MotionError first_error{};
  std::size_t first_over = 0;
  // Largest ratio to the normal error over the frames that `wrong` counts.
  double most = 0;
  // Largest ratio to the normal error over all kIntegrityFrames.
  double max_full = 0;
};
/// `poses` in order, one for each frame, also the lost ones. The first `ok` pose after one that is
/// not has no motion that is claimed, and is judged by `wrong_over_all` alone.
[[nodiscard]] Integrity evaluate_integrity(std::span<const EvaluatedPose> poses,
                                           const NormalError& normal, const app::Trajectory& truth);

}  // namespace vergence::test
