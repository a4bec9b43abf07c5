#include "tests/support/feature_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vergence::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// Height of the camera above the road, m.
constexpr double kHeight = 1.7;
/// Length of a block of the street, m.
constexpr double kBlock = 12.0;
/// As far as the backdrop.
constexpr int kBlocksAhead = 9;
/// m/s².
constexpr double kAcceleration = 2.0;
/// Share of the features on the road that are kept.
constexpr double kGroundKept = 0.4;
/// Above it is sky, m.
constexpr double kBackdropHeight = 15;
/// Nothing nearer is looked at, m.
constexpr double kBonnet = 2.0;
/// Tries for one new feature; two in three hit something.
constexpr int kTries = 200;
// Root mean square over the image of 1, x, y, x² − 1/3, xy, y² − 1/3 with x, y in −1 … 1.
constexpr std::array<double, 6> kFieldRms{1.0, 0.57735, 0.57735, 0.29814, 0.33333, 0.29814};

/// Uniform in [0, 1) from what a thing is: the street is the same whenever one looks.
double draw(std::uint64_t seed, std::int64_t block, std::uint64_t what) {
  std::uint64_t z = seed * 0x9E3779B97F4A7C15ULL +
                    static_cast<std::uint64_t>(block) * 0xBF58476D1CE4E5B9ULL +
                    what * 0x94D049BB133111EBULL;
  for (int i = 0; i < 2; ++i) z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL, z ^= z >> 27U;
  return static_cast<double>(z >> 11U) * 0x1.0p-53;
}

}  // namespace

FeatureDrive::FeatureDrive(const FeatureDriveOptions& options)
    : options_(options), random_(options.seed, 77), T_right_left_(options.T_right_left) {
  for (double& p : phases_) p = random_.uniform(0, 2 * std::numbers::pi);
  for (Field& f : field_)
    for (double& a : f) a = random_.normal();
  speed_ = options.drive_s > 0 ? 0 : options.speed;
  points_.reserve(static_cast<std::size_t>(options.tracks));
  tracks_.reserve(static_cast<std::size_t>(options.tracks));
}

Stamp FeatureDrive::stamp() const noexcept {
  return Stamp(static_cast<std::int64_t>(static_cast<double>(frame_) * 1e9 / options_.rate));
}

void FeatureDrive::next() {
  if (started_) ++frame_;
  move();
  // It stood still before the first frame.
  if (!started_) poses_[1] = poses_[0];
  wander();
  T_right_left_ = options_.T_right_left;
  for (const RigChange& c : options_.changes) {
    if (frame_ < c.frame) continue;
    const double share =
        c.over == 0
            ? 1.0
            : std::min(1.0, static_cast<double>(frame_ - c.frame) / static_cast<double>(c.over));
    T_right_left_ = perturbed(T_right_left_, share * c.rotation, share * c.translation);
  }
  double lag = 0;
  for (const LagChange& c : options_.lags)
    if (frame_ >= c.frame) lag = c.frames;
  const Transform before = T_left_world_;
  T_left_world_ = pose_at(std::max(0.0, -lag));
  T_right_world_ = T_right_left_ * pose_at(std::max(0.0, lag));
  T_now_previous_ = started_ ? T_left_world_ * before.inverse() : Transform{};

  tracks_.clear();
  std::size_t kept = 0;
  for (Point& p : points_) {
    p.p_world += p.velocity;
    FeatureTrack t;
    if (--p.life <= 0 || !sight(&p, &t)) continue;
    points_[kept++] = p;
    tracks_.push_back(t);
  }
  points_.resize(kept);
  for (int missing = options_.tracks - static_cast<int>(kept); missing > 0; --missing) {
    Point p;
    FeatureTrack t;
    if (!new_point(&p) || !sight(&p, &t)) continue;
    if (!started_)
      // Not all are born in the first frame.
      p.life = 1 + static_cast<int>(random_.below(static_cast<std::uint32_t>(p.life)));
    points_.push_back(p);
    tracks_.push_back(t);
  }
  started_ = true;
}

void FeatureDrive::move() {
  const double dt = 1.0 / options_.rate;
  if (started_) {
    double requested = options_.speed;
    if (options_.drive_s > 0) {
      phase_s_ = std::fmod(phase_s_ + dt, options_.drive_s + options_.stop_s);
      if (phase_s_ > options_.drive_s - options_.speed / kAcceleration) requested = 0;
    }
    speed_ += std::clamp(requested - speed_, -kAcceleration * dt, kAcceleration * dt);
    rocked_s_ += dt * std::min(1.0, speed_ / 2.0);
  }
  const auto wave = [&](double hertz, std::size_t phase) {
    return std::sin(2 * std::numbers::pi * hertz * rocked_s_ + phases_[phase]);
  };
  // Hz.
  constexpr double kWeave = 0.14;
  const double a = options_.rocking;
  const double pitch = a * 0.3 * kDegree * (0.6 * wave(1.1, 0) + 0.4 * wave(1.7, 1));
  const double roll = a * 0.35 * kDegree * (0.6 * wave(0.8, 2) + 0.4 * wave(1.4, 3));
  const double heave = a * 0.015 * wave(1.3, 4);
  // The last term leads back to the middle.
  const double heading =
      a * 1.7 * kDegree / (2 * std::numbers::pi * kWeave) * wave(kWeave, 5) - 0.005 * x_;
  if (started_) {
    x_ += speed_ * dt * std::sin(heading);
    z_ += speed_ * dt * std::cos(heading);
  }
  const Mat3 R_world_left =
      exp_so3({0, heading, 0}) * exp_so3({pitch, 0, 0}) * exp_so3({0, 0, roll});
  poses_[1] = poses_[0];
  poses_[0] = Transform{R_world_left, {x_, -kHeight + heave, z_}}.inverse();
}

void FeatureDrive::wander() {
  const double keep = std::exp(-1.0 / (options_.rate * options_.bias_s)),
               add = std::sqrt(1 - keep * keep);
  for (Field& f : field_)
    for (double& a : f) a = keep * a + add * random_.normal();
}

Transform FeatureDrive::pose_at(double frames_ago) const noexcept {
  return interpolate(poses_[0], poses_[1], frames_ago);
}

bool FeatureDrive::project(const Vec3& p_world, Vec2* left, Vec2* right) const noexcept {
  const auto into = [this](const Vec3& q, const Pinhole& k, Vec2* pixel) {
    if (q.z() < 0.5 * kBonnet) return false;
    *pixel = {k.fx * q.x() / q.z() + k.cx, k.fy * q.y() / q.z() + k.cy};
    return pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= options_.width - 1 &&
           pixel->y() <= options_.height - 1;
  };
  return into(T_left_world_ * p_world, options_.left, left) &&
         into(T_right_world_ * p_world, options_.right, right);
}

bool FeatureDrive::sight(Point* point, FeatureTrack* track) {
  Point& p = *point;
  Vec2 left, right;
  if (!project(p.p_world, &left, &right)) return false;
  const Vec2 bias = bias_at(right);
  std::array<double, 4> e{};
  for (std::size_t i = 0; i < 4; ++i) {
    p.walked[i] += options_.walk_px * random_.normal();
    e[i] =
        options_.constant_px * p.constant[i] + p.walked[i] + options_.white_px * random_.normal();
  }
  track->id = p.id;
  track->left = left + Vec2(e[0], e[1]);
  track->right = right + Vec2(e[2], e[3]) + bias + p.offset;
  track->sigma_px = options_.sigma_px;
  track->p_world = p.p_world;
  track->wrong = p.wrong;
  return true;
}

bool FeatureDrive::new_point(Point* p) {
  const Transform T_world_left = T_left_world_.inverse();
  for (int i = 0; i < kTries; ++i) {
    const Vec2 pixel(random_.uniform(0, options_.width - 1),
                     random_.uniform(0, options_.height - 1));
    const Vec3 ray((pixel.x() - options_.left.cx) / options_.left.fx,
                   (pixel.y() - options_.left.cy) / options_.left.fy, 1);
    Vec2 left, right;
    if (!hit(T_world_left.t, T_world_left.R * ray, &p->p_world)) continue;
    if (p->p_world.y() > -1e-6 && random_.uniform() >= kGroundKept) continue;
    if (!project(p->p_world, &left, &right)) continue;
    p->id = next_id_++;
    p->life = options_.shortest_life + static_cast<int>(random_.below(static_cast<std::uint32_t>(
                                           options_.longest_life - options_.shortest_life + 1)));
    for (double& c : p->constant) c = random_.normal();
    const double kind = random_.uniform();
    if (kind < options_.outliers) {
      const double angle = random_.uniform(0, 2 * std::numbers::pi);
      p->offset = random_.uniform(3, 30) * Vec2(std::cos(angle), std::sin(angle));
    } else if (kind < options_.outliers + options_.movers) {
      p->velocity = Vec3(random_.uniform(-3, 3), 0, random_.uniform(-10, 10)) / options_.rate;
    }
    p->wrong = kind < options_.outliers + options_.movers;
    return true;
  }
  return false;
}

bool FeatureDrive::hit(const Vec3& origin, const Vec3& ray, Vec3* p) const noexcept {
  double nearest = 1e9;
  // A wall x = const.
  const auto try_at = [&](double along, double low_z, double high_z, double height) {
    if (!(along > 0) || along >= nearest) return;
    const Vec3 q = origin + along * ray;
    if (q.z() < low_z || q.z() > high_z || q.y() > 0 || q.y() < -height) return;
    nearest = along;
  };
  if (ray.y() > 1e-9) nearest = -origin.y() / ray.y();
  const auto first = static_cast<std::int64_t>(std::floor(origin.z() / kBlock));
  // The camera is between the walls.
  const std::uint64_t side = ray.x() > 0 ? 1 : 0;
  const double sign = side == 1 ? 1.0 : -1.0;
  for (std::int64_t block = first; block < first + kBlocksAhead && std::abs(ray.x()) > 1e-9;
       ++block) {
    const auto of = [&](std::uint64_t what) { return draw(options_.seed, block, 2 * what + side); };
    const double z = kBlock * static_cast<double>(block);
    if (of(0) < 0.8)
      try_at((sign * (5 + 10 * of(1)) - origin.x()) / ray.x(), z, z + kBlock, 4 + 6 * of(2));
    if (of(3) < 0.35) try_at((sign * (3 + of(4)) - origin.x()) / ray.x(), z + 3, z + 7.5, 1.5);
  }
  const double backdrop =
      (60 + 40 * draw(options_.seed, first, 10) - std::fmod(origin.z(), kBlock)) / ray.z();
  const bool in_front = ray.z() > 0 && backdrop < nearest;
  if (in_front && origin.y() + backdrop * ray.y() < -kBackdropHeight) return false;
  if (in_front) nearest = backdrop;
  if (nearest > 200 || nearest < kBonnet) return false;
  *p = origin + nearest * ray;
  return true;
}

Vec2 FeatureDrive::bias_at(const Vec2& right) const noexcept {
  const double x = 2 * right.x() / (options_.width - 1) - 1,
               y = 2 * right.y() / (options_.height - 1) - 1;
  const std::array<double, 6> basis{1, x, y, x * x - 1.0 / 3, x * y, y * y - 1.0 / 3};
  Vec2 b = Vec2::Zero();
  for (std::size_t i = 0; i < 6; ++i)
    b += basis[i] / kFieldRms[i] * Vec2(field_[0][i], field_[1][i]);
  return options_.bias_px / std::sqrt(6.0) * b;
}

}  // namespace vergence::test
