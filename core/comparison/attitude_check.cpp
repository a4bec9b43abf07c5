#include "core/comparison/attitude_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vergence {

void AttitudeCheck::add(const Vec2& place, double sigma, double yaw) noexcept {
  // A step of four sigmas has a course accurate to about 15 degrees; longer steps cut corners.
  // Limits are in metres.
  constexpr double kSigmas = 4, kShortest = 2, kLongest = 10;
  // Maximum difference, twice the course error of the shortest step.
  constexpr double kMaxOff = 30 * std::numbers::pi / 180;
  if (!anchor_) anchor_ = place;
  const Vec2 step = place - *anchor_;
  // A position jump or an outage counts as a step of at most twice the longest ordinary one.
  constexpr double kMaxOfStep = 20;
  const double length = std::min(step.norm(), kMaxOfStep);
  if (length < std::clamp(kSigmas * sigma, kShortest, kLongest)) return;
  anchor_ = place;
  course_ = std::atan2(step.y(), step.x());
  const bool off = std::abs(std::remainder(*course_ - yaw, 2 * std::numbers::pi)) > kMaxOff;
  against_ = off ? against_ + length : 0;
  with_ = off ? 0 : with_ + length;
  (off ? all_against_ : all_with_) += length;
  if (against_ >= kDistance) contradicted_ = true;
  if (with_ >= kDistance) contradicted_ = false;
}

}  // namespace vergence
