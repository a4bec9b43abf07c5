#pragma once
#include <functional>

#include "core/types/rig_frame.hpp"
#include "drivers/mock/world/drive.hpp"
#include "drivers/mock/world/renderer.hpp"

namespace vergence::test {

/// The rig of the paper's experiment: 1024 × 768 px, 0.75 m, its published intrinsics and
/// extrinsics, no distortion.
[[nodiscard]] RigCalibration paper_rig();
/// The rig that `rig.nominal` of app/config/mock.yaml describes: 640 × 480 px, parallel cameras
/// 0.75 m apart.
[[nodiscard]] RigCalibration nominal_rig();

struct RenderedDriveOptions {
  // True rig.
  RigCalibration rig = paper_rig();
  mock::DriveOptions drive{};
  // Time of frame 0 within the drive.
  double from_s = 8;
  // Frame rate in Hz.
  double rate = 30;
  /// The true T_camera_left of camera k in frame i; empty: the rig's.
  std::function<Transform(int k, std::uint64_t frame)> placed{};
};

/// A drive through the mock's suburb, rendered frame by frame as it is asked for; two threads. The
/// same options, the same pixels.
class RenderedDrive {
 public:
  explicit RenderedDrive(const RenderedDriveOptions& options);
  ~RenderedDrive();

  /// Frame i; its images live until the next call.
  [[nodiscard]] const RigFrame& frame(std::uint64_t i);
  [[nodiscard]] Transform T_enu_left(std::uint64_t i) const;
  [[nodiscard]] Transform T_camera_left(int k, std::uint64_t i) const;
  [[nodiscard]] const RigCalibration& rig() const noexcept;
  /// Times into the drive at which the vehicle is faster than `speed` for `seconds` on end, spread
  /// over it.
  [[nodiscard]] static std::vector<double> starts(const mock::DriveOptions& drive, int count,
                                                  double speed, double seconds);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace vergence::test
