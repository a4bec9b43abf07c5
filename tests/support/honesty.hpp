#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "app/datasets/trajectory_files.hpp"
#include "core/types/pose_sample.hpp"

/// What makes an `ok` pose wrong, one definition for recorded drives and for the mock's faults.
///
/// A pose is wrong when the motion over the last kHonestyFrames frames, its way or its turn, is off
/// by more than kHonestyTimes what is normal: what it is off by on the mean of the untouched drive.
/// Of the mock's, where corners are several times harder than the rest, the mean around the same
/// place counts where that is more.
namespace vergence::test {

inline constexpr std::size_t kHonestyFrames = 20;  // fewer at the beginning
inline constexpr double kHonestyTimes = 5;
/// A turn that is normal at least, rad: five times it are a tenth of a degree.
inline constexpr double kLeastNormalTurn = 0.02 * std::numbers::pi / 180;

/// The true pose nearest in time; null beyond half of EuRoC's interval of truth. Valid as long as
/// `truth`.
[[nodiscard]] const Transform* true_pose(const app::Trajectory& truth, Stamp stamp);

struct JudgedPose {
  Stamp stamp{};
  PoseStatus status = PoseStatus::lost;
  Transform T_world_left{};
};

struct MotionError {
  double way_m = 0, turn_rad = 0;
};
/// Mean error of the motion by the number of frames that it is over; of poses that are not `lost`
/// and whose truth is known.
using NormalErrors = std::array<MotionError, kHonestyFrames + 1>;
[[nodiscard]] NormalErrors normal_errors(std::span<const JudgedPose> poses,
                                         const app::Trajectory& truth);

/// What is normal at a time of the drive over that many frames.
using NormalError = std::function<MotionError(Stamp at, std::size_t frames)>;
/// Of the untouched drive, the mean or that of a second around the same time, whichever is more.
[[nodiscard]] NormalError normal_error_there(std::vector<JudgedPose> poses, app::Trajectory truth);

struct Honesty {
  int ok = 0, lost = 0;
  int wrong = 0;           // `ok`, and wrong over its frames since the last that was not `ok`
  int wrong_over_all = 0;  // `ok`, and wrong over its frames since the last that was `lost`
  int unjudged = 0;        // `ok`, and at its stamp or at that of the first pose it is held against
                           // there is no truth: it says where the rig was at another time
  std::size_t first_wrong =
      0;  // index; with it what its motion is off by, and over how many frames
  MotionError first_error{};
  std::size_t first_over = 0;
  double most = 0;       // times the normal error, of those that `wrong` counts among
  double most_full = 0;  // the same of those over all kHonestyFrames
};
/// `poses` in order, one for each frame, also the lost ones. The first `ok` pose after one that is
/// not has no motion that is claimed, and is judged by `wrong_over_all` alone.
[[nodiscard]] Honesty judge_honesty(std::span<const JudgedPose> poses, const NormalError& normal,
                                    const app::Trajectory& truth);

}  // namespace vergence::test
