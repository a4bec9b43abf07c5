#include "app/recording/messages.hpp"

#include <libdeflate.h>

#include <algorithm>

namespace vergence::app {
namespace {

constexpr std::array<double, 9> kNotMeasured{-1, 0, 0, 0, 0, 0, 0, 0, 0};

void put_vector(CdrWriter* out, const Vec3& v) noexcept { out->put(v.x()).put(v.y()).put(v.z()); }

void put_quaternion(CdrWriter* out, const Mat3& R) noexcept {
  const Eigen::Quaterniond q = quaternion(R);
  out->put(q.x()).put(q.y()).put(q.z()).put(q.w());
}

void put_matrix(CdrWriter* out, const Mat3& M) noexcept {
  for (int i = 0; i < 9; ++i) out->put(M(i / 3, i % 3));
}

std::array<double, 36> full_matrix(const Covariance6& upper) noexcept {
  std::array<double, 36> full;
  auto next = upper.begin();
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = i; j < 6; ++j)
      full[6 * i + j] = full[6 * j + i] = static_cast<double>(*next++);
  return full;
}

/// Of all that was written so far.
void put_crc(CdrWriter* out) noexcept {
  const auto bytes = out->written();
  out->put(crc32_of(bytes));
}

/// What rectifies a pair: x along the baseline, z between the optical axes. R maps from a camera
/// into the axes common to both.
struct Rectification {
  Mat3 R = Mat3::Identity();
  double focal = 0, cx = 0, cy = 0;  // px
  double baseline_x = 0;             // m: 0 for the left camera, −|baseline| for the other
};

/// Of `camera` as half of the pair that it makes with camera 0; camera 0 itself is that with
/// camera 1.
Rectification rectification(const RigCalibration& rig, int camera, bool calibrated) noexcept {
  const auto& lenses = rig.intrinsics;
  const Intrinsics& lens = lenses[static_cast<std::size_t>(camera)];
  Rectification r{Mat3::Identity(), lens.fx, lens.cx, lens.cy, 0};
  if (!calibrated || rig.cameras < 2) return r;
  const auto other = static_cast<std::size_t>(std::max(camera, 1));
  const Transform& T_other_left = rig.T_camera_left[other];
  const Vec3 centre = T_other_left.centre();
  const Vec3 x = centre.normalized();
  const Vec3 axes = Vec3::UnitZ() + T_other_left.R.transpose() * Vec3::UnitZ();
  const Vec3 z = (axes - axes.dot(x) * x).normalized();
  Mat3 R_common_left;
  R_common_left << x.transpose(), z.cross(x).transpose(), z.transpose();
  if (!(centre.norm() > 0) || !R_common_left.allFinite()) return r;
  r.focal = (lenses[0].fx + lenses[0].fy + lenses[other].fx + lenses[other].fy) / 4;
  r.cx = lenses[0].cx;
  r.cy = lenses[0].cy;
  r.R = camera == 0 ? R_common_left : Mat3(R_common_left * T_other_left.R.transpose());
  r.baseline_x = camera == 0 ? 0 : -centre.norm();
  return r;
}

void put_diagnostic(CdrWriter* out, const Diagnostic& d) noexcept {
  out->put(static_cast<std::uint8_t>(d.level)).text(d.name).text(d.message).text("vergence");
  out->count(d.values.size());
  for (const DiagnosticValue& value : d.values) {
    std::array<char, 24> digits{};
    auto* end = digits.data() + digits.size();
    auto* at = end;
    const bool negative = value.value < 0;
    auto rest = negative ? 0U - static_cast<std::uint64_t>(value.value)
                         : static_cast<std::uint64_t>(value.value);
    do *--at = static_cast<char>('0' + rest % 10), rest /= 10;
    while (rest > 0);
    if (negative) *--at = '-';
    out->text(value.key).text({at, static_cast<std::size_t>(end - at)});
  }
}

}  // namespace

std::uint32_t crc32_of(std::span<const std::uint8_t> bytes) noexcept {
  return libdeflate_crc32(0, bytes.data(), bytes.size());
}

void write_image(CdrWriter* out, Stamp stamp, std::string_view frame,
                 const ImageView& image) noexcept {
  const auto width = static_cast<std::uint32_t>(image.width);
  const auto height = static_cast<std::uint32_t>(image.height);
  out->header(stamp, frame).put(height).put(width).text("mono8").boolean(false).put(width);
  out->count(std::size_t{width} * height);
  for (int y = 0; y < image.height; ++y) out->raw({image.row(y), width});
}

void write_compressed_image(CdrWriter* out, Stamp stamp, std::string_view frame,
                            std::string_view format, std::span<const std::uint8_t> file) noexcept {
  out->header(stamp, frame).text(format).count(file.size()).raw(file);
}

void write_camera_info(CdrWriter* out, Stamp stamp, std::string_view frame,
                       const RigCalibration& rig, int camera, bool calibrated) noexcept {
  const Intrinsics& lens = rig.intrinsics[static_cast<std::size_t>(camera)];
  const bool radtan = lens.kind == CameraModelKind::pinhole_radtan;
  out->header(stamp, frame);
  out->put(static_cast<std::uint32_t>(lens.height)).put(static_cast<std::uint32_t>(lens.width));
  out->text(radtan ? "plumb_bob" : "equidistant");
  const std::size_t coefficients = radtan ? 5 : 4;
  out->count(coefficients);
  for (std::size_t i = 0; i < coefficients; ++i) out->put(lens.distortion[i]);
  out->items(std::array{lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0});
  const Rectification r = rectification(rig, camera, calibrated);
  put_matrix(out, r.R);
  const double fy = calibrated ? r.focal : lens.fy;
  out->items(std::array{r.focal, 0.0, r.cx, r.focal * r.baseline_x, 0.0, fy, r.cy, 0.0, 0.0, 0.0,
                        1.0, 0.0});
  for (int i = 0; i < 6; ++i) out->put(std::uint32_t{0});  // binning, region of interest: all
  out->boolean(false);
}

void write_nav_sat_fix(CdrWriter* out, const InsSample& s) noexcept {
  out->header(s.stamp, "ins");
  const bool fix = s.fix == FixStatus::fix_2d || s.fix == FixStatus::fix_3d;
  constexpr std::uint16_t kGps = 1;
  out->put(static_cast<std::int8_t>(fix ? 0 : -1)).put(kGps);
  out->put(s.position.latitude_deg).put(s.position.longitude_deg).put(s.position.height_m);
  const double horizontal = s.position_sigma * s.position_sigma;
  out->items(std::array{horizontal, 0.0, 0.0, 0.0, horizontal, 0.0, 0.0, 0.0,
                        s.height_sigma * s.height_sigma});
  constexpr std::uint8_t kUnknown = 0, kDiagonalKnown = 2;
  out->put(s.position_sigma > 0 ? kDiagonalKnown : kUnknown);
}

void write_imu(CdrWriter* out, const InsSample& s) noexcept {
  out->header(s.stamp, "ins").items(s.q_enu_ins);
  const double tilt = s.tilt_sigma * s.tilt_sigma;
  out->items(s.attitude_valid ? std::array{tilt, 0.0, 0.0, 0.0, tilt, 0.0, 0.0, 0.0,
                                           s.heading_sigma * s.heading_sigma}
                              : kNotMeasured);
  for (int i = 0; i < 2; ++i) {  // rates, accelerations
    put_vector(out, Vec3::Zero());
    out->items(kNotMeasured);
  }
}

void write_ins_reading(CdrWriter* out, const InsSample& s, const InsQuality& q) noexcept {
  out->header(s.stamp, "ins").put(s.number).put(s.stamp.ns()).put(s.stamp_error.ns());
  out->put(static_cast<std::uint8_t>(s.fix)).boolean(s.attitude_valid).boolean(s.velocity_valid);
  out->put(s.position.latitude_deg).put(s.position.longitude_deg).put(s.position.height_m);
  out->items(s.velocity_enu).items(s.q_enu_ins);
  out->put(s.position_sigma).put(s.height_sigma).put(s.velocity_sigma);
  out->put(s.tilt_sigma).put(s.heading_sigma);
  out->put(q.status).boolean(q.utc_valid).put(q.utc_ns).put(q.satellites).put(q.position_dop);
  out->boolean(q.filter_valid).boolean(q.sync_out);
  put_crc(out);
}

void write_odometry(CdrWriter* out, const PoseSample& sample) noexcept {
  out->header(sample.stamp, "world").text("left");
  const bool posed = sample.status != PoseStatus::lost;
  const Transform T = posed ? sample.T_world_left : Transform{};
  put_vector(out, T.t);
  put_quaternion(out, T.R);
  std::array<double, 36> covariance = full_matrix(sample.covariance);
  if (!posed) covariance[0] = -1.0;
  out->items(covariance);
  put_vector(out, Vec3::Zero());
  put_vector(out, Vec3::Zero());
  covariance = {};
  covariance[0] = -1.0;  // the speed is not measured
  out->items(covariance);
}

void write_pose_transform(CdrWriter* out, const PoseSample& sample) noexcept {
  out->count(1).header(sample.stamp, "world").text("left");
  put_vector(out, sample.T_world_left.t);
  put_quaternion(out, sample.T_world_left.R);
}

void write_rig_transforms(CdrWriter* out, Stamp stamp, const RigCalibration& rig,
                          std::span<const std::string_view> names) noexcept {
  const auto cameras = std::min(static_cast<std::size_t>(rig.cameras), names.size());
  out->count(cameras > 0 ? cameras - 1 : 0);
  for (std::size_t k = 1; k < cameras; ++k) {
    // ROS writes where the child is in its parent.
    const Transform T_left_camera = rig.T_camera_left[k].inverse();
    out->header(stamp, names[0]).text(names[k]);
    put_vector(out, T_left_camera.t);
    put_quaternion(out, T_left_camera.R);
  }
}

void write_diagnostics(CdrWriter* out, Stamp stamp, std::span<const Diagnostic> status) noexcept {
  out->header(stamp, "").count(status.size());
  for (const Diagnostic& d : status) put_diagnostic(out, d);
}

void write_text(CdrWriter* out, std::string_view text) noexcept { out->text(text); }

void write_frame(CdrWriter* out, const FrameRecord& f) noexcept {
  out->header(f.stamp, "left").put(f.number).put(f.stamp.ns()).put(f.stamp_error.ns());
  out->put(f.spread.ns()).put(f.pairing).put(static_cast<std::uint8_t>(f.cameras));
  out->put(f.images_present).put(f.images_recorded).count(f.image_crc.size()).items(f.image_crc);
  out->boolean(f.recalibration_requested).boolean(f.solver_done);
  const PoseSample& s = f.sample;
  out->put(static_cast<std::uint8_t>(s.state)).put(static_cast<std::uint8_t>(s.status));
  out->put(static_cast<std::uint8_t>(s.reason));
  put_vector(out, s.T_world_left.t);
  put_quaternion(out, s.T_world_left.R);
  out->put(static_cast<std::int32_t>(s.inliers)).put(s.reprojection_px).put(s.estimate_ms);
  out->put(s.effort.points_percent).put(s.effort.window_keyframes).put(s.effort.window_steps);
  put_crc(out);
}

void write_pulse(CdrWriter* out, Stamp stamp, const Pulse& pulse, Stamp edge) noexcept {
  out->header(stamp, "board").put(pulse.number).put(pulse.boot).put(pulse.edge.ns());
  out->put(pulse.arrival.ns()).boolean(pulse.resumed);
  std::uint8_t seen = 0;
  for (std::size_t k = 0; k < pulse.exposure.size(); ++k)
    if (pulse.exposure[k].seen) seen = static_cast<std::uint8_t>(seen | 1U << k);
  out->put(seen).count(pulse.exposure.size());
  for (const PulseExposure& e : pulse.exposure) out->put(e.start.ns());
  out->count(pulse.exposure.size());
  for (const PulseExposure& e : pulse.exposure) out->put(e.end.ns());
  out->boolean(pulse.mapped).put(edge.ns()).put(pulse.host_error.ns());
}

}  // namespace vergence::app
