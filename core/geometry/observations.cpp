#include "core/geometry/observations.hpp"

#include <cassert>
#include <cmath>

namespace vergence {

bool RigObservations::consistent() const noexcept {
  if (cameras < 1 || cameras > kMaxCameras) return false;
  const std::size_t n = x.size();
  if (y.size() != n || z.size() != n || sigma.size() != n || seen.size() != n) return false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(cameras); ++k) {
    if (u[k].size() != n || v[k].size() != n) return false;
    const Pinhole& p = pinhole[k];
    if (!(p.fx > 0) || !(p.fy > 0) || !std::isfinite(p.fx + p.fy + p.cx + p.cy)) return false;
    if (!T_camera_left[k].finite()) return false;
  }
  return true;
}

bool RigObservations::usable(std::size_t i, int camera) const noexcept {
  const auto k = static_cast<std::size_t>(camera);
  return sees(i, camera) && std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]) &&
         std::isfinite(u[k][i]) && std::isfinite(v[k][i]) && sigma[i] > 0 &&
         std::isfinite(sigma[i]);
}

RigObservationTable::RigObservationTable(std::size_t capacity, Arena& arena)
    : x_(arena.make<double>(capacity, "rig observations")),
      y_(arena.make<double>(capacity, "rig observations")),
      z_(arena.make<double>(capacity, "rig observations")),
      sigma_(arena.make<double>(capacity, "rig observations")),
      seen_(arena.make<std::uint8_t>(capacity, "rig observations")) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(kMaxCameras); ++k) {
    u_[k] = arena.make<double>(capacity, "rig observations");
    v_[k] = arena.make<double>(capacity, "rig observations");
  }
}

void RigObservationTable::set_rig(const RigCalibration& rig) noexcept {
  assert(rig.cameras >= 1 && rig.cameras <= kMaxCameras);
  rig_.cameras = rig.cameras;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const Intrinsics& c = rig.intrinsics[k];
    rig_.pinhole[k] = {c.fx, c.fy, c.cx, c.cy};
    rig_.T_camera_left[k] = rig.T_camera_left[k];
  }
}

bool RigObservationTable::push(const Vec3& p_world, double sigma_px) noexcept {
  if (size_ == x_.size()) return false;
  x_[size_] = p_world.x();
  y_[size_] = p_world.y();
  z_[size_] = p_world.z();
  sigma_[size_] = sigma_px;
  seen_[size_] = 0;
  ++size_;
  return true;
}

void RigObservationTable::see(int camera, const Vec2& pixel) noexcept {
  assert(size_ > 0 && camera >= 0 && camera < rig_.cameras);
  const auto k = static_cast<std::size_t>(camera);
  u_[k][size_ - 1] = pixel.x();
  v_[k][size_ - 1] = pixel.y();
  seen_[size_ - 1] = static_cast<std::uint8_t>(seen_[size_ - 1] | (1U << k));
}

RigObservations RigObservationTable::view() const noexcept {
  RigObservations out = rig_;
  out.x = x_.first(size_);
  out.y = y_.first(size_);
  out.z = z_.first(size_);
  out.sigma = sigma_.first(size_);
  out.seen = seen_.first(size_);
  for (std::size_t k = 0; k < static_cast<std::size_t>(kMaxCameras); ++k) {
    out.u[k] = u_[k].first(size_);
    out.v[k] = v_[k].first(size_);
  }
  return out;
}

}  // namespace vergence
