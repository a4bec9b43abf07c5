#include "drivers/mock/world/drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/math/random.hpp"

namespace vergence::mock {
namespace {

constexpr double kPi = std::numbers::pi;
/// Distance in m left of the centreline, as traffic keeps left.
constexpr double kLane = 1.9;
/// Distance in m between samples of the speed profile.
constexpr double kArcStep = 0.1;
/// Radius in m.
constexpr double kTurnRadius = 10.0;

// ---- the path

struct Route {
  /// Corners of the polyline, rounded with kTurnRadius.
  std::vector<Vec2> corners;
  /// Distances in m along the path at which the vehicle stops.
  std::vector<double> stops;
};

Route make_route(DriveKind kind) {
  constexpr double X = kStreetSpacingX, Y = kStreetSpacingY, o = kLane;
  switch (kind) {
    case DriveKind::loop:
      return {
          {{-o, 40}, {-o, 2 * Y + o}, {2 * X + o, 2 * Y + o}, {2 * X + o, -o}, {-o, -o}, {-o, 46}},
          {285.0, 700.0}};
    case DriveKind::figure_eight:
      return {{{X - o, 40},
               {X - o, 2 * Y + o},
               {2 * X + o, 2 * Y + o},
               {2 * X + o, Y - o},
               {o, Y - o},
               {o, o},
               {X - o, o},
               {X - o, 46}},
              {40.0, 420.0}};
    case DriveKind::straight:
      return {{{-90, 2 * Y + o}, {390, 2 * Y + o}}, {226.0}};
    case DriveKind::brief:
      return {{{-o, 150}, {-o, 2 * Y + o}, {72, 2 * Y + o}}, {}};
    case DriveKind::still:
      return {{{-o, 40}, {-o, 41}}, {}};
  }
  return {};
}

/// Lines and arcs by length.
class Path {
 public:
  explicit Path(const std::vector<Vec2>& corners) {
    Vec2 at = corners.front();
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const Vec2 d = (corners[i] - corners[i - 1]).normalized();
      const double heading = std::atan2(d.y(), d.x());
      if (i + 1 == corners.size()) {
        line(at, heading, (corners[i] - at).norm());
        break;
      }
      const Vec2 e = (corners[i + 1] - corners[i]).normalized();
      const double turn = std::atan2(d.x() * e.y() - d.y() * e.x(), d.dot(e));
      const double tangent = kTurnRadius * std::tan(0.5 * std::abs(turn));
      line(at, heading, (corners[i] - tangent * d - at).norm());
      pieces_.push_back({length_, corners[i] - tangent * d, heading,
                         turn > 0 ? 1 / kTurnRadius : -1 / kTurnRadius});
      length_ += kTurnRadius * std::abs(turn);
      at = corners[i] + tangent * e;
    }
  }

  struct Point {
    Vec2 position;
    /// The heading is not wrapped, so it is continuous along the path.
    double heading;
    /// Curvature in 1/m, positive to the left.
    double curvature;
  };
  [[nodiscard]] Point at(double s) const {
    s = std::clamp(s, 0.0, length_);
    std::size_t i = 0;
    double heading = pieces_[0].heading;
    for (; i + 1 < pieces_.size() && pieces_[i + 1].start <= s; ++i)
      heading += pieces_[i].curvature * (pieces_[i + 1].start - pieces_[i].start);
    const Piece& p = pieces_[i];
    const double along = s - p.start;
    const Vec2 forward(std::cos(p.heading), std::sin(p.heading)), left(-forward.y(), forward.x());
    if (p.curvature == 0) return {p.position + along * forward, heading, 0};
    const double angle = p.curvature * along;
    return {p.position + (std::sin(angle) * forward + (1 - std::cos(angle)) * left) / p.curvature,
            heading + angle, p.curvature};
  }
  [[nodiscard]] double length() const { return length_; }

 private:
  struct Piece {
    double start;
    Vec2 position;
    double heading, curvature;
  };
  void line(const Vec2& from, double heading, double length) {
    pieces_.push_back({length_, from, heading, 0});
    length_ += length;
  }
  std::vector<Piece> pieces_;
  double length_ = 0;
};

// ---- the driver

/// Maximum time in s of standing at the start and at the end, however long stops are.
constexpr double kLongestEnd = 60;

/// Distance driven at every kDriveStep: the fastest way along the path within the limits, with
/// pauses.
std::vector<double> distances(const Path& path, const std::vector<double>& stops,
                              const DriveOptions& o) {
  const auto n = static_cast<std::size_t>(path.length() / kArcStep) + 1;
  const double step = path.length() / static_cast<double>(n);
  std::vector<double> v2(n + 1);
  for (std::size_t i = 0; i <= n; ++i) {
    const double curvature = std::abs(path.at(step * static_cast<double>(i)).curvature);
    v2[i] = std::min(o.speed * o.speed, curvature > 0 ? o.lateral / curvature : 1e9);
  }
  std::vector<std::size_t> halts{0, n};
  for (const double s : stops) halts.push_back(static_cast<std::size_t>(s / step));
  std::sort(halts.begin(), halts.end());
  for (const std::size_t h : halts) v2[h] = 0;
  for (std::size_t i = 1; i <= n; ++i)
    v2[i] = std::min(v2[i], v2[i - 1] + 2 * o.acceleration * step);
  for (std::size_t i = n; i-- > 0;)
    v2[i] = std::min(v2[i], v2[i + 1] + 2 * 1.3 * o.acceleration * step);

  const double dt = kDriveStep.to_seconds(), ends = std::min(o.stop_s, kLongestEnd);
  std::vector<double> out;
  // Time at sample i of the path.
  double time = 0;
  const auto emit_until = [&](double until, double s0, double s1, double t0, double v0, double v1) {
    while (static_cast<double>(out.size()) * dt < until) {
      const double t = static_cast<double>(out.size()) * dt - t0, span = until - t0;
      out.push_back(std::clamp(s0 + v0 * t + 0.5 * (v1 - v0) / span * t * t, s0, s1));
    }
  };
  for (std::size_t i = 0; i <= n; ++i) {
    const double s = step * static_cast<double>(i);
    if (std::binary_search(halts.begin(), halts.end(), i)) {
      const double stand = i == 0 || i == n ? ends : o.stop_s;
      emit_until(time + stand, s, s, time, 0, 0);
      time += stand;
    }
    if (i == n) break;
    const double v0 = std::sqrt(v2[i]), v1 = std::sqrt(v2[i + 1]), span = 2 * step / (v0 + v1);
    emit_until(time + span, s, s + step, time, v0, v1);
    time += span;
  }
  out.push_back(path.length());
  return out;
}

/// Normal kernel; beyond the ends the first and last value go on.
std::vector<double> smoothed(const std::vector<double>& in, double sigma_s) {
  const double sigma = sigma_s / kDriveStep.to_seconds();
  const auto reach = static_cast<std::ptrdiff_t>(4 * sigma);
  std::vector<double> kernel;
  double sum = 0;
  for (std::ptrdiff_t k = -reach; k <= reach; ++k)
    sum += kernel.emplace_back(std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma)));
  std::vector<double> out(in.size());
  const auto last = static_cast<std::ptrdiff_t>(in.size()) - 1;
  for (std::ptrdiff_t i = 0; i <= last; ++i) {
    double v = 0;
    for (std::ptrdiff_t k = -reach; k <= reach; ++k)
      v += kernel[static_cast<std::size_t>(k + reach)] *
           in[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i + k, 0, last))];
    out[static_cast<std::size_t>(i)] = v / sum;
  }
  return out;
}

// ---- the springs

/// A sum of sines with random phases: smooth, bounded, without memory.
class Disturbance {
 public:
  Disturbance(Random* random, double low_hz, double high_hz, double amplitude) {
    for (Wave& w : waves_)
      w = {2 * kPi * random->uniform(low_hz, high_hz), random->uniform(0, 2 * kPi),
           amplitude * random->uniform(0.25, 0.55)};
  }
  [[nodiscard]] double at(double t) const noexcept {
    double sum = 0;
    for (const Wave& w : waves_) sum += w.amplitude * std::sin(w.frequency * t + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double frequency, phase, amplitude;
  };
  std::array<Wave, 4> waves_;
};

const DriveOptions& checked(const DriveOptions& o) {
  const auto in = [](double v, double lo, double hi, const char* name) {
    if (!(v >= lo && v <= hi))
      throw std::invalid_argument(std::string("mock drive: ") + name + " must be between " +
                                  std::to_string(lo) + " and " + std::to_string(hi));
  };
  in(o.speed, 0.01, 20, "speed");
  in(o.acceleration, 0.3, 4, "acceleration");
  in(o.lateral, 0.5, 5, "lateral");
  in(o.suspension, 0, 3, "suspension");
  in(o.vibration, 0, 5, "vibration");
  in(o.stop_s, 1, 3600, "stop_s");
  return o;
}

}  // namespace

Drive::Drive(const DriveOptions& options, const World& world) : options_(checked(options)) {
  const Route route = make_route(options_.kind);
  const Path path(route.corners);
  std::vector<double> s;
  if (options_.kind == DriveKind::still) {
    s.assign(static_cast<std::size_t>(30.0 / kDriveStep.to_seconds()) + 1, 0.0);
  } else {
    // Time in s that a foot needs to move the pedal.
    constexpr double kFoot = 0.30;
    s = smoothed(distances(path, route.stops, options_), kFoot);
    length_ = path.length();
  }
  const std::size_t n = s.size();
  std::vector<double> x(n), y(n), yaw(n), curvature(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Path::Point p = path.at(s[i]);
    x[i] = p.position.x();
    y[i] = p.position.y();
    yaw[i] = p.heading;
    curvature[i] = p.curvature;
  }
  // Time in s that hands need to turn the wheel.
  constexpr double kHands = 0.25;
  x = smoothed(x, kHands);
  y = smoothed(y, kHands);
  yaw = smoothed(yaw, kHands);
  curvature = smoothed(curvature, kHands);

  Random random(options_.seed, 30);
  const double degree = kPi / 180;
  const Disturbance pitch(&random, 0.5, 1.9, 0.22 * degree * options_.suspension),
      roll(&random, 0.4, 1.6, 0.25 * degree * options_.suspension);
  const Disturbance heave(&random, 0.6, 2.0, 0.011 * options_.suspension),
      wander(&random, 0.05, 0.3, 0.10);
  const Disturbance shake_pitch(&random, 6, 12, 0.018 * degree * options_.vibration),
      shake_roll(&random, 6, 12, 0.018 * degree * options_.vibration);
  const Disturbance shake_heave(&random, 6, 12, 0.0006 * options_.vibration);
  // Lean of the body in rad per m/s².
  constexpr double kSpring = 0.0055;

  const double dt = kDriveStep.to_seconds();
  control_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i == 0 ? 0 : i - 1, b = std::min(i + 1, n - 1);
    const double t = static_cast<double>(i) * dt, v = (s[b] - s[a]) / (2 * dt),
                 forward = (s[b] - 2 * s[i] + s[a]) / (dt * dt);
    // A standing body is not shaken.
    const double lively = v * v / (v * v + 4.0);
    const double c = std::cos(yaw[i]), sn = std::sin(yaw[i]), slope = world.ground_slope(x[i]);
    // Across the lane the driver wanders a little.
    const double across = lively * wander.at(t);
    Control& p = control_[i];
    p << x[i] - across * sn, y[i] + across * c,
        world.ground(x[i], y[i]) + lively * (heave.at(t) + shake_heave.at(t)), yaw[i],
        std::atan(slope * c) + options_.suspension * kSpring * forward +
            lively * (pitch.at(t) + shake_pitch.at(t)),
        std::atan(-slope * sn) + options_.suspension * kSpring * v * v * curvature[i] +
            lively * (roll.at(t) + shake_roll.at(t));
  }
}

Duration Drive::duration() const noexcept {
  return kDriveStep * static_cast<std::int64_t>(control_.size() - 1);
}

BodyState Drive::at(Duration time) const noexcept {
  const std::int64_t last = static_cast<std::int64_t>(control_.size()) - 1;
  const std::int64_t ns = std::clamp<std::int64_t>(time.ns(), 0, kDriveStep.ns() * last);
  const std::int64_t cell = std::min(ns / kDriveStep.ns(), last - 1);
  const double u =
      static_cast<double>(ns - cell * kDriveStep.ns()) / static_cast<double>(kDriveStep.ns());
  // Uniform quintic B-spline: six basis polynomials over one cell, coefficients of u⁰ … u⁵ times
  // 120.
  constexpr double kBasis[6][6] = {{1, -5, 10, -10, 5, -1},  {26, -50, 20, 20, -20, 5},
                                   {66, 0, -60, 0, 30, -10}, {26, 50, 20, -20, -20, 10},
                                   {1, 5, 10, 10, 5, -5},    {0, 0, 0, 0, 0, 1}};
  Control p = Control::Zero(), d1 = Control::Zero(), d2 = Control::Zero();
  for (int k = 0; k < 6; ++k) {
    double w = 0, w1 = 0, w2 = 0;
    // Evaluates value, slope and half the curvature by Horner's method.
    for (int j = 5; j >= 0; --j) {
      w2 = w2 * u + w1;
      w1 = w1 * u + w;
      w = w * u + kBasis[k][j];
    }
    const Control& c =
        control_[static_cast<std::size_t>(std::clamp<std::int64_t>(cell + k - 2, 0, last))];
    p += w / 120 * c;
    d1 += w1 / 120 * c;
    d2 += 2 * w2 / 120 * c;
  }
  const double rate = 1.0 / kDriveStep.to_seconds();
  d1 *= rate;
  d2 *= rate * rate;

  BodyState state;
  // R = Rz(yaw) Ry(−pitch) Rx(roll)
  const double yaw = p[3], theta = -p[4], roll = p[5];
  state.T_enu_body.R =
      exp_so3(Vec3(0, 0, yaw)) * exp_so3(Vec3(0, theta, 0)) * exp_so3(Vec3(roll, 0, 0));
  state.T_enu_body.t = p.head<3>();
  state.velocity = d1.head<3>();
  state.acceleration = d2.head<3>();
  const double st = std::sin(theta), ct = std::cos(theta), sr = std::sin(roll), cr = std::cos(roll);
  state.angular_rate = {d1[5] - st * d1[3], -cr * d1[4] + sr * ct * d1[3],
                        sr * d1[4] + cr * ct * d1[3]};
  return state;
}

Transform camera_mount(const Vec3& position_body, double tilt_down) noexcept {
  // The columns are the camera's right, down and forward in body axes.
  Mat3 R;
  R << 0, -std::sin(tilt_down), std::cos(tilt_down), -1, 0, 0, 0, -std::cos(tilt_down),
      -std::sin(tilt_down);
  return {R, position_body};
}

}  // namespace vergence::mock
