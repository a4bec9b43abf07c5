#pragma once
#include <array>
#include <cstddef>
#include <span>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"
#include "core/types/time.hpp"

/// Estimates the transform between the body of a reference (an INS) and of an estimate (the left
/// camera) from a run: hand-eye calibration with a clock offset.
///
/// Model     With T_ref_est = (R_m, l) the estimate's body in the reference's, and T_enu_world the
///           estimate's world on the earth:
///               R_enu_ref R_m        = Exp(e_R) R_enu_world R_world_est
///               p_enu_ref + R_enu_ref l = R_enu_world p_world_est + t + e_p
///               v_enu_ref + R_enu_ref (R_m ω × l) = R_enu_world v_world_est + e_v
///           with the estimate at the reference's stamp − `clock_offset`. Errors e of tilt,
///           heading, horizontal and vertical position, and velocity are first-order Gauss–Markov
///           processes whose correlation and size are estimated from the residuals (feasible
///           generalised least squares). With enough blocks of the run, a sigma is at least that of
///           their scatter (cluster-robust covariance).
/// Sources   Wahba's problem for the start; Cochrane and Orcutt 1949 for the whitening; Bell and
///           McCaffrey 2002 for the blocks.
namespace vergence {

struct MountReference {
  Stamp stamp{};
  Transform T_enu_ref{};
  /// Velocity, in m/s.
  Vec3 v_enu_ref = Vec3::Zero();
  bool has_velocity = false;
};

struct MountOptions {
  /// Interval between compared moments, rounded to that of the samples.
  Duration step = Duration::milliseconds(500);
  /// Maximum gap of the estimate that is interpolated.
  Duration max_gap = Duration::milliseconds(200);
  /// Minimum correlation time of attitude and position errors, because a run is too short to
  /// measure it.
  Duration min_correlation = Duration::seconds(60);
  /// Maximum standard deviations of an observable parameter: in rad (two degrees, as accurate as a
  /// drawing) and in m.
  double rotation_sigma = 0.035;
  double lever_sigma = 0.5;
  Duration offset_sigma = Duration::milliseconds(30);
};

/// A value with its standard deviation, if it is observable.
struct MountValue {
  bool observable = false;
  /// Meaningless unless observable.
  double value = 0;
  /// Valid even if not observable.
  double sigma = 0;
};

enum class MountStatus : std::uint8_t {
  ok,
  /// There are fewer than kMountMoments consecutive moments in common.
  too_few,
  no_motion,
  /// There is no fit, or an implausible one: a clock offset of 0.3 s, or errors of 15 degrees.
  not_converged,
};
inline constexpr std::size_t kMountMoments = 20;

struct Mount {
  /// Estimate; unobservable parameters are zero: rotations about the start's axes, and the lever
  /// arm.
  Transform T_ref_est{};
  /// Left perturbation of `nominal` about x, y, z of the reference's axes, in rad.
  std::array<MountValue, 3> rotation{};
  /// In the reference's axes, in m.
  std::array<MountValue, 3> lever_arm{};
  /// Delay of the reference's stamps, in s.
  MountValue clock_offset{};
  std::size_t moments = 0;
  /// Root mean square of e_R in rad, and of e_p in m.
  double residual_rotation = 0;
  double residual_position = 0;
};

/// `nominal`: design rotation, to which rotations refer and which replaces unobservable ones.
/// Precondition: ascending stamps. Allocates; not for the real-time path. Time: linear in the
/// moments, kMountRounds rounds. If the result is not `ok`, *mount is unchanged.
[[nodiscard]] MountStatus estimate_ins_extrinsics(std::span<const StampedPose> estimate,
                                                  std::span<const MountReference> reference,
                                                  const Mat3& nominal, const MountOptions& options,
                                                  Mount* mount);

/// Maximum number of whitening rounds; runs with INS errors take 7 to 16.
inline constexpr int kMountRounds = 24;

}  // namespace vergence
