#include "app/publish/live_frame_builder.hpp"

namespace vergence::app {

void LiveFrameBuilder::add(const RigFrame& frame) noexcept {
  if (any_ && frame.number > frame_.number + 1) now_.missing += frame.number - frame_.number - 1;
  any_ = true;
  frame_ = frame;
}

const LiveFrame& LiveFrameBuilder::add(const PoseSample& sample, HostStamp now) noexcept {
  now_.pose = PublishedPose::of(sample, now);
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
  now_.age_ms = tie_ ? (tie_->stamp_at(now) - sample.stamp).to_seconds() * 1e3 : -1;
  return now_;
}

}  // namespace vergence::app
