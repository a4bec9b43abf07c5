#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "core/math/se3.hpp"
#include "core/types/stamped_pose.hpp"
#include "core/types/time.hpp"

/// Transform between the body of a reference (an INS) and the body of an estimate (the left
/// camera), estimated from a drive: hand-eye calibration with a clock offset.
///
/// Model     With T_ref_est = (R_m, l), the estimate's body in the reference's, and T_enu_world,
/// the estimate's world on the earth:
///               R_enu_ref R_m        = Exp(e_R) R_enu_world R_world_est
///               p_enu_ref + R_enu_ref l = R_enu_world p_world_est + t + e_p
///               v_enu_ref + R_enu_ref (R_m ω × l) = R_enu_world v_world_est + e_v
///           the estimate taken at the reference's stamp − `clock_offset`. A reference's errors
///           wander: e of tilt, heading, horizontal and vertical place and velocity are each
///           first-order Gauss–Markov, their correlation and size found from the residuals
///           (feasible generalised least squares), so that a sigma tells what the drive can tell,
///           not what its many samples seem to. Where the drive has blocks enough, a sigma is no
///           smaller than what their scatter tells (cluster-robust covariance).
/// Sources   Wahba's problem for the start; Cochrane and Orcutt 1949 for the whitening; Bell and
///           McCaffrey 2002 for the blocks.
namespace vergence {

/// One moment of the reference.
struct MountReference {
  Stamp stamp{};
  Transform T_enu_ref{};
  Vec3 v_enu_ref = Vec3::Zero();  // m/s
  bool has_velocity = false;
};

struct MountOptions {
  // Between the moments that are compared, as nearly as the reference's readings give it.
  Duration step = Duration::milliseconds(500);
  Duration max_gap = Duration::milliseconds(200);  // of the estimate, that is bridged
  Duration min_correlation = Duration::seconds(
      60);  // of attitude and place: a drive is too short to tell how slowly they wander
  // A parameter whose sigma is above this is `not_observable`.
  double rotation_sigma = 0.035;  // rad, two degrees: accuracy of a drawing
  double lever_sigma = 0.5;       // m
  Duration offset_sigma = Duration::milliseconds(30);
};

/// A number and its sigma; nothing: the drive does not show it.
struct MountValue {
  bool observable = false;
  double value = 0;  // meaningless unless observable
  double sigma = 0;  // also where it is not: how far from it
};

enum class MountStatus : std::uint8_t {
  ok,
  too_few,        // fewer than kMountMoments moments in common that follow on one another
  no_motion,      // nothing moved: nothing shows
  not_converged,  // no fit, or none that can be: a clock offset of 0.3 s, errors of 15 degrees
};
inline constexpr std::size_t kMountMoments = 20;

struct Mount {
  /// Estimate, zero where it is not observable: of rotation about the start's axes, of
  /// the lever arm.
  Transform T_ref_est{};
  std::array<MountValue, 3>
      rotation{};  // rad: x, y, z of the left perturbation of `nominal`, in the reference's axes
  std::array<MountValue, 3> lever_arm{};  // m, in the reference's axes
  MountValue clock_offset{};              // s: the reference's stamps are late by it
  std::size_t moments = 0;
  double residual_rotation = 0;  // rad, root mean square of e_R
  double residual_position = 0;  // m, of e_p
};

/// `nominal`: rotation by the drawing; rotations are reported relative to it, and it
/// stands where the drive tells none. Stamps ascend (precondition). Memory: the heap; not for the
/// real-time path. Time: linear in the moments, kMountRounds rounds. Not `ok`: *mount untouched.
[[nodiscard]] MountStatus estimate_ins_extrinsics(std::span<const StampedPose> estimate,
                                                  std::span<const MountReference> reference,
                                                  const Mat3& nominal, const MountOptions& options,
                                                  Mount* mount);

/// Maximum number of whitening rounds; drives with an INS's errors take 7 to 16.
inline constexpr int kMountRounds = 24;

}  // namespace vergence
