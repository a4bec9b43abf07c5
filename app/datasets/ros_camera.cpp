#include "app/datasets/ros_camera.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr double kSameRectification =
    1e-6;  // relative: focal lengths of the two projection matrices

}  // namespace

std::string set_ros_distortion(std::string_view model, std::span<const double> d,
                               Intrinsics* lens) {
  const bool equidistant = model == "equidistant";
  if (!equidistant && model != "plumb_bob" && model != "rational_polynomial")
    return fmt::format(
        "is of the model \"{}\"; plumb_bob, equidistant and rational_polynomial are known",
        model.substr(0, 60));
  if (equidistant ? d.size() != 4 : d.size() > 8) return fmt::format("has {} numbers", d.size());
  const auto used = d.first(std::min<std::size_t>(5, d.size()));
  const auto zero = [](double v) { return v == 0; };
  if (const auto rest = d.subspan(used.size()); !std::all_of(rest.begin(), rest.end(), zero))
    return "has k4 to k6 of a rational polynomial, which this program's radtan has not; calibrate "
           "as plumb_bob";
  lens->kind = equidistant ? CameraModelKind::pinhole_equidistant : CameraModelKind::pinhole_radtan;
  std::copy(used.begin(), used.end(), lens->distortion.begin());
  return "";
}

std::string set_ros_rig(const RosCamera& left, const RosCamera& right, RigCalibration* rig) {
  const Mat34 &P_l = left.P, &P_r = right.P;
  const auto differ = [&](int i) {
    return !(std::abs(P_l(i, i) - P_r(i, i)) <= kSameRectification * P_l(i, i));
  };
  if (differ(0) || differ(1))
    return fmt::format(
        "has the focal length {}, that of the left camera {}: they are not of one stereo "
        "calibration",
        P_r(0, 0), P_l(0, 0));
  const Vec3 apart((P_r(0, 3) - P_l(0, 3)) / P_r(0, 0), (P_r(1, 3) - P_l(1, 3)) / P_r(1, 1), 0);
  if (!(apart.norm() > 0))
    return "has no baseline: the fourth number of its first row is −fx·B in a stereo calibration";
  rig->cameras = 2;
  rig->intrinsics[0] = left.lens;
  rig->intrinsics[1] = right.lens;
  Transform& T = rig->T_camera_left[1];
  T.R = right.R.transpose() * left.R;
  T.t = right.R.transpose() * apart;
  rig->baseline = T.t.norm();
  return "";
}

}  // namespace vergence::app
