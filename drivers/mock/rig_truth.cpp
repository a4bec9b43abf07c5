#include "drivers/mock/rig_truth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vergence::mock {

RigTruth::RigTruth(std::shared_ptr<const World> world, const DriveOptions& drive,
                   const RigCalibration& rig, const Transform& T_body_left,
                   const Transform& T_body_ins, std::vector<Fault> faults)
    : world_(std::move(world)),
      drive_(drive, *world_),
      rig_(rig),
      T_body_ins_(T_body_ins),
      faults_(std::move(faults)) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k)
    mounts_[k] = T_body_left * rig.T_camera_left[k].inverse();
}

Transform RigTruth::camera_on_body(int camera, Duration time) const noexcept {
  // Transform from the mounted pose to the current one.
  Transform T_moved_camera;
  for (const Fault& f : faults_) {
    if (!f.concerns(camera) || time < f.at) continue;
    double part = 0;
    if (f.kind == FaultKind::knock) part = 1;
    if (f.kind == FaultKind::drift)
      part = std::min(1.0, (time - f.at).to_seconds() / f.duration.to_seconds());
    if (part > 0)
      T_moved_camera = Transform{exp_so3(part * f.turn), part * f.shift} * T_moved_camera;
  }
  return mounts_[static_cast<std::size_t>(camera)] * T_moved_camera.inverse();
}

std::optional<Transform> RigTruth::bus_in_enu(Duration time) const noexcept {
  // The last scheduled occluder.
  const Fault* bus = nullptr;
  for (const Fault& f : faults_)
    if (f.kind == FaultKind::occluder && f.active(time)) bus = &f;
  if (bus == nullptr) return std::nullopt;
  const Transform T_enu_body = drive_.at(time).T_enu_body;
  const Vec3 forward = T_enu_body.R.col(0);
  const Mat3 R_enu_level = exp_so3(Vec3(0, 0, std::atan2(forward.y(), forward.x())));
  const double turn = bus->turn.z(), way = bus->speed * (time - bus->at).to_seconds();
  // From its middle to the face that is turned to the vehicle.
  const double reach =
      0.5 * (kBusLength * std::abs(std::cos(turn)) + kBusWidth * std::abs(std::sin(turn)));
  const Vec3 middle(mounts_[0].t.x() + bus->shift.x() + reach + way * std::cos(turn),
                    bus->shift.y() + way * std::sin(turn), 0);
  Transform T{R_enu_level * exp_so3(Vec3(0, 0, turn)), T_enu_body.t + R_enu_level * middle};
  T.t.z() = world_->ground(T.t.x(), T.t.y());
  return T;
}

RigCalibration RigTruth::calibration(Duration time) const noexcept {
  RigCalibration rig = rig_;
  const Transform T_body_left = camera_on_body(0, time);
  for (int k = 1; k < rig.cameras; ++k)
    rig.T_camera_left[static_cast<std::size_t>(k)] =
        camera_on_body(k, time).inverse() * T_body_left;
  return rig;
}

}  // namespace vergence::mock
