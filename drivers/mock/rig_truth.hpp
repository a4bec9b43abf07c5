#pragma once
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/types/calibration.hpp"
#include "drivers/mock/faults.hpp"
#include "drivers/mock/world/drive.hpp"

namespace vergence::mock {

/// Ground truth of everything on the vehicle at a time since the start of the drive: the drive's
/// spline, the mounts, and the faults that move them. Constant after construction.
class RigTruth {
 public:
  /// `rig` is the calibration before any fault. p_body = T_body_left · p_left, p_body = T_body_ins
  /// · p_ins.
  RigTruth(std::shared_ptr<const World> world, const DriveOptions& drive, const RigCalibration& rig,
           const Transform& T_body_left, const Transform& T_body_ins, std::vector<Fault> faults);

  [[nodiscard]] const World& world() const noexcept { return *world_; }
  [[nodiscard]] std::shared_ptr<const World> shared_world() const noexcept { return world_; }
  [[nodiscard]] const Drive& drive() const noexcept { return drive_; }
  [[nodiscard]] const RigCalibration& mounted() const noexcept { return rig_; }
  [[nodiscard]] const std::vector<Fault>& faults() const noexcept { return faults_; }

  /// p_body = T · p_camera. A knock moves it: p_camera' = Exp(turn) p_camera + shift.
  [[nodiscard]] Transform camera_on_body(int camera, Duration time) const noexcept;
  /// p_enu = T · p_camera.
  [[nodiscard]] Transform camera_in_enu(int camera, Duration time) const noexcept {
    return drive_.at(time).T_enu_body * camera_on_body(camera, time);
  }
  /// p_enu = T · p_ins.
  [[nodiscard]] Transform ins_in_enu(Duration time) const noexcept {
    return drive_.at(time).T_enu_body * T_body_ins_;
  }
  /// Pose of the bus of an active occluder: p_enu = T · p_bus (x forward, y left, z up, origin in
  /// the middle of its floor). It stands level on the ground. Empty if there is none.
  [[nodiscard]] std::optional<Transform> bus_in_enu(Duration time) const noexcept;
  /// True calibration of the rig at that time.
  [[nodiscard]] RigCalibration calibration(Duration time) const noexcept;

 private:
  std::shared_ptr<const World> world_;
  Drive drive_;
  RigCalibration rig_;
  // Transforms T_body_camera.
  std::array<Transform, kMaxCameras> mounts_{};
  Transform T_body_ins_;
  std::vector<Fault> faults_;
};

}  // namespace vergence::mock
