#include "app/devices/rig_settings.hpp"

#include <cctype>
#include <numbers>

#include "app/config/calibration_checks.hpp"
#include "app/config/calibration_file.hpp"
#include "app/devices/drive_sync.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/transform_rows.hpp"
#include "core/math/random.hpp"

namespace vergence::app {
namespace {

// Fraction of the image width, a field of 70° as in machine-vision rigs on cars.
constexpr double kFocalOfWidth = 0.72;

Intrinsics read_intrinsics(const Configuration& c, const CameraSettings& camera) {
  Intrinsics lens{.kind = camera.model, .width = camera.width, .height = camera.height};
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

Transform camera_transform(const Configuration& c, std::size_t k) {
  const auto& rows = c.cameras[k].T_camera_left;
  if (std::ranges::all_of(rows, [](double v) { return v == 0; }))
    return {Mat3::Identity(), {-static_cast<double>(k) * c.rig.baseline_m, 0, 0}};
  return transform_of(rows);
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

Vec3 vec3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

int camera_count(const Configuration& c) {
  int n = 0;
  for (std::size_t k = 0; k < c.cameras.size(); ++k) {
    if (c.cameras[k].driver.empty()) continue;
    if (static_cast<int>(k) != n)
      throw InputError(
          "cameras.{} has a driver, but cameras.{} before it has none; set its driver, or remove "
          "it",
          k, k - 1);
    ++n;
  }
  return n;
}

void check_cameras(const Configuration& c) {
  const int n = camera_count(c);
  if (n < 2)
    throw InputError(
        "cameras: {0} configured, and two are needed for scale; add them, for example cameras: "
        "[{{driver: {1}}}, {{driver: {1}}}]",
        n == 0 ? "no camera is" : "one camera is", n == 0 ? "mock" : c.cameras[0].driver);
  for (std::size_t k = 1; k < static_cast<std::size_t>(n); ++k)
    if (c.cameras[k].width != c.cameras[0].width || c.cameras[k].height != c.cameras[0].height)
      throw InputError(
          "cameras.{}.size is {} x {}, but that of camera 0 is {} x {}; set the same size for all "
          "cameras",
          k, c.cameras[k].width, c.cameras[k].height, c.cameras[0].width, c.cameras[0].height);
}

RigCalibration mounted_rig(const Configuration& c) {
  RigCalibration rig{.cameras = camera_count(c)};
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    rig.intrinsics[k] = read_intrinsics(c, c.cameras[k]);
    if (k > 0) rig.T_camera_left[k] = camera_transform(c, k);
  }
  rig.baseline = rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&rig))
    throw InputError("rig.nominal and cameras: " + bad->message);
  return rig;
}

RigCalibration nominal_rig(const Configuration& c) {
  RigCalibration rig = mounted_rig(c);
  if (c.cameras[0].driver != "mock") return rig;
  add_intrinsics_error(c.mock.intrinsics_error, &rig);
  add_calibration_error(c.mock.calibration_error, &rig);
  if (const auto bad = find_implausible(&rig))
    throw InputError("mock.calibration_error and intrinsics_error: " + bad->message);
  return rig;
}

ComparisonOptions comparison_options(const Configuration& c) {
  ComparisonOptions o;
  o.T_ins_left =
      mount_of(vec3(c.ins.lever_arm_m), vec3(c.ins.boresight_deg) * (std::numbers::pi / 180));
  o.alignment_distance_m = c.comparison.alignment_distance_m;
  o.correlation_s = c.comparison.correlation_s;
  o.heading_sigma_rad = c.comparison.heading_sigma_deg * (std::numbers::pi / 180);
  o.max_gap = Duration::seconds(c.comparison.max_gap_ms * 1e-3);
  o.max_wait = Duration::seconds(c.comparison.max_wait_ms * 1e-3);
  // Samples of these protocols are 0.1 to 1 s apart.
  if (c.ins.driver == "nmea" || c.ins.driver == "ubx") {
    o.max_gap = std::max(o.max_gap, Duration::seconds(1.5 / c.ins.rate));
    o.max_wait = std::max(o.max_wait, Duration::seconds(0.5 + 1.5 / c.ins.rate));
  }
  return o;
}

bool exposes_by_itself(const Configuration& c) { return c.exposure.mode != 0; }

exposure::ExposureOptions exposure_options(const Configuration& c) {
  exposure::ExposureOptions o{.target = c.exposure.target,
                              .may_saturate = 0.01 * c.exposure.saturated_percent,
                              .least = microseconds(c.exposure.min_us),
                              .most = microseconds(c.exposure.max_us),
                              .max_gain_db = c.exposure.max_gain_db,
                              .settle_frames = c.exposure.settle_frames};
  if (o.most < o.least) throw InputError("exposure.max_us is below exposure.min_us; raise it");
  if (c.exposure.max_us * 1e-6 * c.trigger.rate > 1)
    throw InputError(
        "exposure.max_us is {}, longer than the {:.0f} µs between two pulses (trigger.rate {}); "
        "lower it",
        c.exposure.max_us, 1e6 / c.trigger.rate, c.trigger.rate);
  return o;
}

ExposureSetting starting_exposure(const Configuration& c, std::size_t k) {
  const CameraSettings& camera = c.cameras[exposes_by_itself(c) ? 0 : k];
  const ExposureSetting own{microseconds(camera.exposure_us), camera.gain_db};
  return exposes_by_itself(c) ? exposure::within(exposure_options(c), own) : own;
}

CameraConfiguration camera_configuration(const Configuration& c, std::size_t k) {
  const CameraSettings& s = c.cameras[k];
  const ExposureSetting start = starting_exposure(c, k);
  CameraConfiguration requested{s.width,        s.height,      c.trigger.rate,
                                start.exposure, start.gain_db, s.trigger};
  requested.offset_x = s.offset_x;
  requested.offset_y = s.offset_y;
  requested.pixel_format = s.pixel_format;
  requested.options = s.options;
  return requested;
}

Configuration capture_configuration(const Configuration& configuration) {
  Configuration c = configuration;
  if (c.sync.mode != SyncMode::ins_syncout) c.ins.driver = "none";
  return c;
}

std::vector<std::string> camera_names(const Configuration& c, int cameras) {
  std::vector<std::string> names;
  for (int k = 0; k < cameras; ++k) {
    std::string name = c.cameras[static_cast<std::size_t>(k)].name;
    std::ranges::replace_if(
        name, [](unsigned char ch) { return std::isalnum(ch) == 0 && ch != '_' && ch != '-'; },
        '_');
    names.push_back(name.empty() ? "camera" + std::to_string(k) : name);
  }
  return distinct_names(names);
}

}  // namespace vergence::app
