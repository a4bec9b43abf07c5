#pragma once
#include <optional>

#include "core/math/types.hpp"

namespace vergence {

/// Whether the heading that an attitude says goes with the way that is driven. An INS without a
/// filter, or mounted another way than is said, tells one thing all the drive long while the
/// vehicle goes another way: such an attitude is worse than none.
///
/// Threads one. Memory: none.
class AttitudeCheck {
 public:
  /// A fix in its order: place in enu, m, its sigma, and the yaw of the camera's view, rad, by the
  /// attitude.
  void add(const Vec2& place, double sigma, double yaw) noexcept;
  /// For the last kDistance m driven heading and course differed by more than 30 degrees. It holds
  /// until they agree for as long.
  [[nodiscard]] bool contradicted() const noexcept { return contradicted_; }
  /// Most of the way heading and course differed.
  [[nodiscard]] bool mostly_off() const noexcept { return all_against_ > all_with_; }
  /// Of the newest step, rad counter-clockwise from east; nothing: none was driven yet.
  [[nodiscard]] std::optional<double> course() const noexcept { return course_; }

 private:
  static constexpr double kDistance = 50;  // m

  std::optional<Vec2> anchor_;
  std::optional<double> course_;
  double against_ = 0, with_ = 0;          // m in a row
  double all_against_ = 0, all_with_ = 0;  // m
  bool contradicted_ = false;
};

}  // namespace vergence
