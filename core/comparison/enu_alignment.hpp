#pragma once
#include <cstdint>
#include <span>

#include "core/math/se3.hpp"
#include "core/types/time.hpp"

namespace vergence {

/// One moment at which both are known: the odometry in its world, the INS (brought to the left
/// camera) in enu.
struct EnuAlignmentPair {
  Stamp stamp{};
  Vec3 p_world_left = Vec3::Zero();  // m
  Vec3 p_enu_left = Vec3::Zero();    // m
  /// Rotation from the INS's attitude alone: R_enu_left · R_left_world. Its roll and pitch are
  /// used, its heading where it has a sigma.
  Mat3 R_enu_world = Mat3::Identity();
  double position_sigma = 0;  // m, horizontal, each axis; > 0
  double height_sigma = 0;    // m; > 0
  double tilt_sigma = 0;      // rad; > 0
  double heading_sigma =
      0;  // rad, of the INS and of how the camera is turned against it; 0: its heading is not used
};

/// Where the odometry's world lies on the earth. Rigid, no scale.
struct EnuAlignment {
  std::uint32_t revision = 0;  // 0: there is none; counts up with each fit
  Transform T_enu_world{};
  Vec3 rotation_sigma = Vec3::Zero();  // rad about east, north, up
  Vec3 position_sigma = Vec3::Zero();  // m, of the stretch's middle
  double residual = 0;                 // m, root mean square of the positions' residuals
  double distance = 0;                 // m driven on the stretch
  int pairs = 0;
  Stamp first{}, last{};
};

enum class EnuAlignmentStatus : std::uint8_t {
  ok,
  too_few,   // fewer than three pairs
  not_held,  // the path is too short to hold a heading
};

/// Least squares for T_enu_world on positions, with the INS's roll and pitch, and its heading where
/// it has a sigma, as one more measurement.
///
/// An INS's errors wander slowly: neighbouring samples repeat one another. `correlation` states for
/// how long; n pairs over a time T count as 1 + T / correlation independent ones, the attitude as
/// one. So the sigma is what 100 m with such a receiver can tell.
/// Memory: none. Time: linear in the pairs, at most kAlignmentSteps passes. Not `ok`: *alignment as
/// it was.
[[nodiscard]] EnuAlignmentStatus fit_enu_alignment(std::span<const EnuAlignmentPair> pairs,
                                                   Duration correlation,
                                                   EnuAlignment* alignment) noexcept;

inline constexpr int kAlignmentSteps = 20;  // Gauss–Newton from the closed-form start takes four

}  // namespace vergence
