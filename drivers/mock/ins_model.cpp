#include "drivers/mock/ins_model.hpp"

#include <cmath>
#include <vector>

#include "core/math/angle.hpp"

namespace vergence::mock {
namespace {}  // namespace

InsModel::InsModel(const InsModelOptions& options, const RigTruth& truth)
    : options_(options),
      truth_(truth),
      plane_(kWorldOrigin.latitude_deg, kWorldOrigin.longitude_deg, kWorldOrigin.height_m),
      random_(options.seed, 71),
      wander_{{{2.12, 60, 0},
               {2.12, 60, 0},
               {4.0, 60, 0},
               {0.1, 5, 0},
               {0.1, 5, 0},
               {0.1, 5, 0},
               {0.5 * kRadiansPerDegree, 30, 0},
               {0.5 * kRadiansPerDegree, 30, 0},
               {1.0 * kRadiansPerDegree, 60, 0}}} {
  for (Wander& w : wander_) w.value = w.sigma * random_.normal();
}

void InsModel::advance() {
  for (Wander& w : wander_) {
    const double keep = std::exp(-1 / (options_.rate_hz * w.correlation_s));
    w.value = keep * w.value + w.sigma * std::sqrt(1 - keep * keep) * random_.normal();
  }
}

InsSample InsModel::sample(std::uint64_t number, Duration time) {
  advance();
  InsSample s;
  s.number = number;
  s.attitude_valid = s.velocity_valid = true;
  s.fix = FixStatus::fix_3d;
  const BodyState body = truth_.drive().at(time);
  Transform T_enu_ins = truth_.ins_in_enu(time);
  // The sensor is carried round by the body: v = v_body + R (ω × r).
  const Vec3 lever = body.T_enu_body.inverse() * T_enu_ins.t;
  Vec3 velocity = body.velocity + body.T_enu_body.R * body.angular_rate.cross(lever);
  bool no_fix = false;
  for (const Fault& f : truth_.faults()) {
    if (f.kind == FaultKind::position_jump && f.active(time)) T_enu_ins.t += f.shift;
    if (f.kind == FaultKind::no_fix && f.active(time)) no_fix = true;
  }
  if (!options_.ideal) {
    const auto at = [this](std::size_t i) { return wander_[i].value; };
    T_enu_ins.t += Vec3(at(0), at(1), at(2));
    velocity += Vec3(at(3), at(4), at(5));
    T_enu_ins.R = exp_so3(Vec3(0, 0, at(8))) * T_enu_ins.R * exp_so3(Vec3(at(6), at(7), 0));
    s.position_sigma = wander_[0].sigma;
    s.height_sigma = wander_[2].sigma;
    s.velocity_sigma = wander_[3].sigma;
    s.tilt_sigma = wander_[6].sigma;
    s.heading_sigma = wander_[8].sigma;
  } else {
    // Minimum in m and m/s, because a sigma of 0 would mean that none is given.
    constexpr double kSmall = 1e-3;
    s.position_sigma = s.height_sigma = s.velocity_sigma = kSmall;
    s.tilt_sigma = s.heading_sigma = 1e-5;
  }
  // Row-major matrix M of v_enu = M · v_local.
  std::vector<double> rotation(9);
  plane_.Reverse(T_enu_ins.t.x(), T_enu_ins.t.y(), T_enu_ins.t.z(), s.position.latitude_deg,
                 s.position.longitude_deg, s.position.height_m, rotation);
  const Mat3 R_enu_local =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  const Eigen::Quaterniond q = quaternion(R_enu_local.transpose() * T_enu_ins.R);
  s.q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
  const Vec3 local = R_enu_local.transpose() * velocity;
  s.velocity_enu = {local.x(), local.y(), local.z()};
  if (no_fix) {
    s.fix = FixStatus::none;
    s.position = {};
    s.position_sigma = s.height_sigma = 0;
  }
  return s;
}

}  // namespace vergence::mock
