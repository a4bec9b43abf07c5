#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/estimator/estimator.hpp"
#include "core/types/stamped_pose.hpp"

namespace vergence::test {

/// 8-bit grey pixels, rows padded to whole cache lines.
struct OwnedImage {
  int width = 0, height = 0;
  std::ptrdiff_t stride = 0;
  std::vector<std::uint8_t> bytes;

  OwnedImage() = default;
  OwnedImage(int w, int h);
  [[nodiscard]] ImageView view() const noexcept { return {bytes.data(), width, height, stride}; }
};

/// A stereo drive in memory with the truth: T_reference_left of every frame, in any world.
struct StereoDrive {
  RigCalibration rig;
  std::vector<Stamp> stamps;
  std::vector<std::array<OwnedImage, 2>> pairs;
  std::vector<Transform> truth;  // T_reference_left

  [[nodiscard]] std::size_t size() const noexcept { return pairs.size(); }
};

/// Estimate of one frame, and the true pose of the left camera when its image was
/// taken.
struct Answer {
  PoseSample sample;
  Transform T_reference_left{};
  bool restarted = false;  // an event said that the scene was rebuilt
};

/// A change of one frame before the estimator sees it. False: the frame never comes.
using Edit = std::function<bool(std::size_t index, RigFrame* frame)>;

struct Replay {
  std::vector<Answer> answers;
  std::uint64_t allocations = 0;  // on sealed threads, from the first frame to the last
};

/// `ok`, or nothing stands against it but that the drive has not confirmed its calibration yet:
/// what is asked of the odometry itself.
[[nodiscard]] inline bool good(const PoseSample& s) noexcept {
  return s.status == PoseStatus::ok ||
         (s.status == PoseStatus::degraded && s.reason == Reason::unverified_calibration);
}

/// Every frame of the drive through a new estimator. `threads`: 1 or 2. `online`: it may find the
/// rig's calibration anew.
[[nodiscard]] Replay replay(const StereoDrive& drive, const Edit& edit = {}, int threads = 1,
                            bool online = true);

/// Difference of two relative motions over the same pair of frames.
struct MotionError {
  double translation = 0;  // m
  double rotation = 0;     // rad
};
[[nodiscard]] MotionError motion_error(const Answer& from, const Answer& to);

/// Maximum error of an `ok` pose relative to the first `ok` pose since the
/// drive's start or the last marked restart.
struct OkBound {
  double translation = 0.05;  // m
  double per_metre = 0.015;   // m of the way driven since
  double rotation = 0.01;     // rad
};

/// The worst breach of the bound among poses called `ok`, in words; empty when there is none.
[[nodiscard]] std::string wrong_ok(const std::vector<Answer>& answers, const OkBound& bound);

/// Frames of [first, last) that were called `ok`.
[[nodiscard]] int count_ok(const std::vector<Answer>& answers, std::size_t first, std::size_t last);

/// One line for every run of frames with the same status and reason: for the message of a failed
/// expectation.
[[nodiscard]] std::string story(const std::vector<Answer>& answers);

}  // namespace vergence::test
