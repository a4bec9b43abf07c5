#pragma once
#include <cstdint>
#include <span>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// Odometry pose in its world and INS position (of the left camera) in enu at one time.
struct EnuAlignmentPair {
  Stamp stamp{};
  /// Positions in metres.
  Vec3 p_world_left = Vec3::Zero();
  Vec3 p_enu_left = Vec3::Zero();
  /// Rotation R_enu_left · R_left_world by the INS's attitude. Its roll and pitch are used, and its
  /// heading if it has a sigma.
  Mat3 R_enu_world = Mat3::Identity();
  /// Horizontal standard deviation per axis, in m, > 0.
  double position_sigma = 0;
  /// Standard deviation of the height, in m, > 0.
  double height_sigma = 0;
  /// Standard deviation of roll and pitch, in rad, > 0.
  double tilt_sigma = 0;
  /// Standard deviation of the heading in rad, including the INS-to-camera rotation; 0 if it is not
  /// used.
  double heading_sigma = 0;
};

/// Rigid transform, without scale, from the odometry's world to the earth.
struct EnuAlignment {
  /// Number of fits so far; 0 if there is none.
  std::uint32_t revision = 0;
  Transform T_enu_world{};
  /// Standard deviations about east, north and up, in rad.
  Vec3 rotation_sigma = Vec3::Zero();
  /// Standard deviation at the middle of the stretch, in m.
  Vec3 position_sigma = Vec3::Zero();
  /// Root mean square of the positions' residuals, in m.
  double residual = 0;
  /// Length of the stretch, in m.
  double distance = 0;
  int pairs = 0;
  Stamp first{}, last{};
};

enum class EnuAlignmentStatus : std::uint8_t {
  ok,
  /// There are fewer than three pairs.
  too_few,
  /// The path is too short to determine a heading.
  not_held,
};

/// Least squares for T_enu_world on positions, the INS's roll and pitch, and its heading if it has
/// a sigma.
///
/// INS errors are correlated over the time `correlation`: n pairs over a time T count as 1 + T /
/// correlation independent ones, and the attitude as one. Does not allocate. Time: linear in the
/// pairs. If the result is not `ok`, *alignment is unchanged.
[[nodiscard]] EnuAlignmentStatus fit_enu_alignment(std::span<const EnuAlignmentPair> pairs,
                                                   Duration correlation,
                                                   EnuAlignment* alignment) noexcept;

/// Maximum number of Gauss–Newton steps; four suffice from the closed-form start.
inline constexpr int kAlignmentSteps = 20;

}  // namespace vergence
