#include "core/odometry/map.hpp"

#include <algorithm>

namespace vergence::odometry {

void Map::clear() noexcept {
  for (MapPoint& p : points()) p.stage = PointStage::free;
  order_.clear();
  next_point_ = used_ = 0;
}

MapPoint* Map::make_point() noexcept {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::size_t slot = (next_point_ + i) % points_.size();
    MapPoint& p = points_[slot];
    if (p.stage != PointStage::free) continue;
    next_point_ = slot + 1;
    used_ = std::max(used_, next_point_);
    p.id = next_id_++;
    p.missed = 0;
    p.found = 0;
    p.now.cameras = 0;
    p.in_images = 0;
    p.across = false;
    p.logged = false;
    for (PointObservation& s : p.seen) s.cameras = 0;
    return &p;
  }
  return nullptr;
}

void Map::drop_oldest_keyframe() noexcept {
  const std::size_t slot = order_[0];
  std::rotate(order_.begin(), order_.begin() + 1, order_.end());
  order_.truncate(order_.size() - 1);
  for (MapPoint& p : points()) {
    if (p.stage == PointStage::free) continue;
    p.seen[slot].cameras = 0;
    if (p.stage != PointStage::dormant) continue;
    const bool still = std::any_of(order_.begin(), order_.end(),
                                   [&](std::uint8_t s) { return p.seen[s].cameras != 0; });
    if (!still) p.stage = PointStage::free;
  }
  while (used_ > 0 && points_[used_ - 1].stage == PointStage::free) --used_;
}

std::size_t Map::make_keyframe(const Keyframe& keyframe) noexcept {
  if (order_.size() >= window_) drop_oldest_keyframe();
  std::size_t slot = 0;
  while (std::find(order_.begin(), order_.end(), slot) != order_.end()) ++slot;
  (void)order_.push(static_cast<std::uint8_t>(slot));
  keyframes_[slot] = keyframe;
  for (MapPoint& p : points()) p.seen[slot].cameras = 0;
  return slot;
}

int Map::observe(std::size_t slot) noexcept {
  int seen = 0;
  for (MapPoint& p : points()) {
    if (!p.followed()) continue;
    p.seen[slot] = p.now;
    seen += p.now.by(0) ? 1 : 0;
  }
  return seen;
}

void Map::scale_about(const Vec3& centre, double factor) noexcept {
  for (MapPoint& p : points()) {
    if (p.stage == PointStage::free) continue;
    p.p_world = centre + factor * (p.p_world - centre);
    p.T_origin_world = scaled_about(p.T_origin_world, centre, factor);
  }
  for (const std::uint8_t slot : order_) {
    Keyframe& k = keyframes_[slot];
    k.T_left_world = scaled_about(k.T_left_world, centre, factor);
    for (Transform& T : k.T_camera_left) T.t *= factor;
  }
}

void Map::move_world(const Transform& T_old_new) noexcept {
  const Transform T_new_old = T_old_new.inverse();
  for (MapPoint& p : points()) {
    if (p.stage == PointStage::free) continue;
    p.p_world = T_new_old * p.p_world;
    p.T_origin_world = p.T_origin_world * T_old_new;
  }
  for (const std::uint8_t slot : order_)
    keyframes_[slot].T_left_world = keyframes_[slot].T_left_world * T_old_new;
}

}  // namespace vergence::odometry
