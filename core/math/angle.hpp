#pragma once
#include <cmath>
#include <numbers>

#include "core/math/types.hpp"

namespace vergence {

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// Angle between two directions of any length, in rad.
[[nodiscard]] inline double angle_between(const Vec3& a, const Vec3& b) noexcept {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace vergence
