#pragma once
#include <optional>

#include "core/math/types.hpp"

namespace vergence {

/// Compares the heading of an INS attitude with the course over ground. An INS without a filter, or
/// one mounted differently than configured, reports a heading that contradicts the motion; such an
/// attitude is not used.
///
/// Not thread-safe. Does not allocate.
class AttitudeCheck {
 public:
  /// Call once per fix, in order. `place`: position in enu, in m; `sigma`: its standard deviation,
  /// in m; `yaw`: of the camera's optical axis by the attitude, in rad counter-clockwise from east.
  void add(const Vec2& place, double sigma, double yaw) noexcept;
  /// True once heading and course have differed by more than 30 degrees over kDistance, until they
  /// have agreed over the same distance.
  [[nodiscard]] bool contradicted() const noexcept { return contradicted_; }
  /// True if heading and course differed over most of the distance travelled.
  [[nodiscard]] bool mostly_off() const noexcept { return all_against_ > all_with_; }
  /// Course of the newest step, in rad counter-clockwise from east; empty before the first.
  [[nodiscard]] std::optional<double> course() const noexcept { return course_; }

 private:
  // Distance in metres, longer than a manoeuvre in reverse.
  static constexpr double kDistance = 50;

  std::optional<Vec2> anchor_;
  std::optional<double> course_;
  // Distances in metres with and against the course, uninterrupted and in total.
  double against_ = 0, with_ = 0;
  double all_against_ = 0, all_with_ = 0;
  bool contradicted_ = false;
};

}  // namespace vergence
