#include "app/devices/rig_settings.hpp"

#include <algorithm>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "app/runtime/errors.hpp"
#include "core/math/random.hpp"

namespace vergence::app {
namespace {

constexpr double kFocalOfWidth =
    0.72;  // of the image's width: 70° across, what machine-vision rigs on cars have

Intrinsics lens_of(const Configuration& c, const CameraSettings& camera) {
  Intrinsics lens;
  lens.width = camera.width;
  lens.height = camera.height;
  lens.kind = camera.model;
  if (camera.intrinsics[0] > 0) {
    lens.fx = camera.intrinsics[0];
    lens.fy = camera.intrinsics[1];
    lens.cx = camera.intrinsics[2];
    lens.cy = camera.intrinsics[3];
    lens.distortion = camera.distortion;
  } else {
    lens.fx = lens.fy = c.rig.focal_px > 0 ? c.rig.focal_px : kFocalOfWidth * lens.width;
    lens.cx = 0.5 * (lens.width - 1);
    lens.cy = 0.5 * (lens.height - 1);
    lens.distortion = {c.rig.k1, c.rig.k2, 0, 0, 0};
  }
  return lens;
}

Transform place_of(const Configuration& c, std::size_t k) {
  const auto& rows = c.cameras[k].T_camera_left;
  Transform T;
  if (std::all_of(rows.begin(), rows.end(), [](double v) { return v == 0; })) {
    T.t = {-static_cast<double>(k) * c.rig.baseline_m, 0, 0};
    return T;
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(rows.data());
  T.R = m.leftCols<3>();
  T.t = m.col(3);
  return T;
}

void add_intrinsics_error(const IntrinsicsErrorSettings& e, RigCalibration* rig) {
  for (int k = 0; k < rig->cameras; ++k) {
    Random random(static_cast<std::uint64_t>(e.seed), 300 + static_cast<std::uint64_t>(k));
    Intrinsics& lens = rig->intrinsics[static_cast<std::size_t>(k)];
    lens.cx += e.principal_point_px * random.normal();
    lens.cy += e.principal_point_px * random.normal();
    const double longer = 1 + 0.01 * e.focal_percent * random.normal();
    lens.fx *= longer;
    lens.fy *= longer;
  }
}

void add_calibration_error(const CalibrationErrorSettings& e, RigCalibration* rig) {
  const Vec3 turn = Vec3(e.pitch_deg, e.yaw_deg, e.roll_deg) * (std::numbers::pi / 180);
  rig->T_camera_left[1] =
      Transform{exp_so3(turn), Vec3(e.x_m, e.y_m, e.z_m)} * rig->T_camera_left[1];
  const double longer = 1 + 0.01 * e.length_percent;
  for (int k = 1; k < rig->cameras; ++k)
    rig->T_camera_left[static_cast<std::size_t>(k)].t *= longer;
  rig->baseline *= longer;
}

}  // namespace

int camera_count(const Configuration& c) {
  int n = 0;
  for (std::size_t k = 0; k < c.cameras.size(); ++k) {
    if (c.cameras[k].driver.empty()) continue;
    if (static_cast<int>(k) != n)
      throw InputError(fmt::format(
          "cameras.{} has a driver, cameras.{} before it has none; the list has no holes", k,
          k - 1));
    ++n;
  }
  return n;
}

RigCalibration mounted_rig(const Configuration& c) {
  RigCalibration rig;
  rig.cameras = camera_count(c);
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    rig.intrinsics[k] = lens_of(c, c.cameras[k]);
    if (k > 0) rig.T_camera_left[k] = place_of(c, k);
  }
  rig.baseline = rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&rig))
    throw InputError("rig.nominal and cameras: " + bad->sentence);
  return rig;
}

RigCalibration nominal_rig(const Configuration& c) {
  RigCalibration rig = mounted_rig(c);
  if (c.cameras[0].driver != "mock") return rig;
  add_intrinsics_error(c.mock.intrinsics_error, &rig);
  add_calibration_error(c.mock.calibration_error, &rig);
  if (const auto bad = find_implausible(&rig))
    throw InputError("mock.calibration_error and intrinsics_error: " + bad->sentence);
  return rig;
}

}  // namespace vergence::app
