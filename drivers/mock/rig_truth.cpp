#include "drivers/mock/rig_truth.hpp"

#include <algorithm>
#include <utility>

namespace vergence::mock {

RigTruth::RigTruth(std::shared_ptr<const World> world, const DriveOptions& drive, const RigCalibration& rig, const Transform& T_body_left,
                   const Transform& T_body_ins, std::vector<Fault> faults)
    : world_(std::move(world)), drive_(drive, *world_), rig_(rig), T_body_ins_(T_body_ins), faults_(std::move(faults)) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) mounts_[k] = T_body_left * rig.T_camera_left[k].inverse();
}

Transform RigTruth::camera_on_body(int camera, Duration time) const noexcept {
  Transform T_moved_camera;  // from where it was mounted to where it is
  for (const Fault& f : faults_) {
    if (!f.concerns(camera) || time < f.at) continue;
    double part = 0;
    if (f.kind == FaultKind::knock) part = 1;
    if (f.kind == FaultKind::drift) part = std::min(1.0, (time - f.at).to_seconds() / f.duration.to_seconds());
    if (part > 0) T_moved_camera = Transform{exp_so3(part * f.turn), part * f.shift} * T_moved_camera;
  }
  return mounts_[static_cast<std::size_t>(camera)] * T_moved_camera.inverse();
}

RigCalibration RigTruth::calibration(Duration time) const noexcept {
  RigCalibration rig = rig_;
  const Transform T_body_left = camera_on_body(0, time);
  for (int k = 1; k < rig.cameras; ++k) rig.T_camera_left[static_cast<std::size_t>(k)] = camera_on_body(k, time).inverse() * T_body_left;
  return rig;
}

}  // namespace vergence::mock
