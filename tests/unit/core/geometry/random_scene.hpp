#pragma once
#include "core/math/random.hpp"
#include "core/math/se3.hpp"

namespace vergence::test {

[[nodiscard]] inline Vec3 random_vector(Random& random, double lo, double hi) {
  const double x = random.uniform(lo, hi), y = random.uniform(lo, hi);
  return {x, y, random.uniform(lo, hi)};
}

/// Rotation of at most `angle` rad about each axis' share, translation within a cube of half side
/// `metres`.
[[nodiscard]] inline Transform random_transform(Random& random, double angle, double metres) {
  const Vec3 phi = random_vector(random, -angle, angle);
  return {exp_so3(phi), random_vector(random, -metres, metres)};
}

/// A point in front of a camera, its own frame: 60°×45° field, depth between near and far, m.
[[nodiscard]] inline Vec3 visible_point(Random& random, double near, double far) {
  const double z = random.uniform(near, far), x = random.uniform(-0.58, 0.58);
  return {x * z, random.uniform(-0.41, 0.41) * z, z};
}

/// Largest of rotation (rad) and relative translation difference.
[[nodiscard]] inline double difference(const Transform& a, const Transform& b) {
  return std::max((a.R - b.R).norm(), (a.t - b.t).norm() / (1.0 + b.t.norm()));
}

}  // namespace vergence::test
