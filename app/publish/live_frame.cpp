#include "app/publish/live_frame.hpp"

#include <cmath>

namespace vergence::app {

EnuPose PublishedEnuAlignment::of(const Transform& T_world_left) const {
  const Transform T_enu_left = alignment.T_enu_world * T_world_left;
  const Vec3 view = T_enu_left.R.col(2);
  return {T_enu_left, LocalTangentPlane(origin).to_geodetic(T_enu_left.t),
          std::atan2(view.y(), view.x())};
}

const char* to_text(Pairing pairing) noexcept {
  switch (pairing) {
    case Pairing::assumed:
      return "assumed";
    case Pairing::verified:
      return "verified";
    case Pairing::contradicted:
      return "contradicted";
  }
  return "";
}

void LiveFrameBuilder::add(const RigFrame& frame) noexcept {
  if (any_ && frame.number > frame_.number + 1) now_.missing += frame.number - frame_.number - 1;
  any_ = true;
  frame_ = frame;
}

const LiveFrame& LiveFrameBuilder::add(const PoseSample& sample, HostStamp now) noexcept {
  now_.pose = sample;
  now_.out = now;
  ++now_.read;
  ++(sample.status == PoseStatus::ok         ? now_.ok
     : sample.status == PoseStatus::degraded ? now_.degraded
                                             : now_.lost);
  if (sample.status != PoseStatus::lost) {
    const Vec3& position = sample.T_world_left.t;
    if (last_position_) now_.path_m += (position - *last_position_).norm();
    last_position_ = position;
  }
  now_.stamp_error = frame_.stamp_error;
  now_.spread = frame_.spread;
  now_.pairing = frame_.pairing;
  now_.cameras = frame_.cameras;
  now_.images_present = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(frame_.cameras); ++k)
    if (!frame_.images[k].empty())
      now_.images_present = static_cast<std::uint8_t>(now_.images_present | 1U << k);
  now_.age_ms = tie_ ? (tie_->stamp_at(now) - sample.stamp).to_seconds() * 1e3 : -1;
  return now_;
}

}  // namespace vergence::app
