#include "app/recording/messages.hpp"

#include <libdeflate.h>

#include <set>

#include <fmt/format.h>

namespace vergence::app {
namespace {

constexpr std::array<double, 9> kNotMeasured{-1, 0, 0, 0, 0, 0, 0, 0, 0};

void put_vector(CdrWriter* out, const Vec3& v) noexcept { out->put(v.x()).put(v.y()).put(v.z()); }

void put_quaternion(CdrWriter* out, const Mat3& R) noexcept {
  const Eigen::Quaterniond q = quaternion(R);
  out->put(q.x()).put(q.y()).put(q.z()).put(q.w());
}

/// Fields of geometry_msgs/Pose and geometry_msgs/Transform.
void put_pose(CdrWriter* out, const Transform& T) noexcept {
  put_vector(out, T.t);
  put_quaternion(out, T.R);
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

/// Checksum of everything written so far.
void put_crc(CdrWriter* out) noexcept {
  const auto bytes = out->written();
  out->put(crc32_of(bytes));
}

/// Fields of the packages common_interfaces and geometry2 as of ROS 2 Humble, without their
/// comments and constants.
struct Definition {
  // Name as in topics, or as in the fields of other definitions, without /msg/.
  std::string_view name;
  std::string_view fields;
};
// The types of RosType come first, in its order.
constexpr std::array kDefinitions{
    Definition{"sensor_msgs/msg/Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
               "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
    Definition{"sensor_msgs/msg/CameraInfo",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
               "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
               "uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
    Definition{"sensor_msgs/msg/NavSatFix",
               "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\n"
               "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\n"
               "uint8 position_covariance_type\n"},
    Definition{"sensor_msgs/msg/Imu",
               "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
               "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
               "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
               "float64[9] linear_acceleration_covariance\n"},
    Definition{"nav_msgs/msg/Odometry",
               "std_msgs/Header header\nstring child_frame_id\n"
               "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n"},
    Definition{"tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"std_msgs/msg/String", "string data\n"},
    // Input and result of one estimator call: everything that a replay needs besides
    // the images. `crc` is the CRC-32 of the message's bytes before it, `image_crc` that of pixels.
    Definition{"vergence_msgs/msg/Frame",
               "std_msgs/Header header\nuint64 number\nint64 stamp_ns\nint64 stamp_error_ns\n"
               "int64 spread_ns\nuint8 pairing\nuint8 cameras\nuint8 images_present\n"
               "uint8 images_recorded\nuint32[] image_crc\nbool recalibration_requested\n"
               "bool solver_done\nuint8 state\nuint8 status\nuint8 reason\n"
               "geometry_msgs/Pose pose\nint32 inliers\nfloat64 reprojection_px\n"
               "float32 estimate_ms\nuint8 points_percent\nuint8 window_keyframes\n"
               "uint8 window_steps\nuint32 crc\n"},
    // INS sample on the host's clock. Body forward, left, up; axes east, north, up.
    Definition{"vergence_msgs/msg/InsReading",
               "std_msgs/Header header\nuint64 number\nint64 stamp_ns\nint64 stamp_error_ns\n"
               "uint8 fix\nbool attitude_valid\nbool velocity_valid\nfloat64 latitude_deg\n"
               "float64 longitude_deg\nfloat64 height_m\nfloat64[3] velocity_enu\n"
               "float64[4] q_enu_ins\nfloat64 position_sigma\nfloat64 height_sigma\n"
               "float64 velocity_sigma\nfloat64 tilt_sigma\nfloat64 heading_sigma\n"
               "uint32 device_status\nbool utc_valid\nint64 utc_ns\nuint8 satellites\n"
               "float32 position_dop\nbool filter_valid\nbool sync_out\nuint32 crc\n"},
    Definition{"vergence_msgs/msg/Pulse",
               "std_msgs/Header header\nuint64 number\nuint32 boot\nint64 edge_device_ns\n"
               "int64 arrival_host_ns\nbool resumed\nuint8 exposures_seen\n"
               "int64[] exposure_start_ns\nint64[] exposure_end_ns\nbool mapped\n"
               "int64 edge_ns\nint64 edge_error_ns\n"},
    Definition{"geometry_msgs/msg/PoseWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
    Definition{"diagnostic_msgs/msg/DiagnosticArray",
               "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    // The following types are parts of the others.
    Definition{"diagnostic_msgs/DiagnosticStatus",
               "byte level\nstring name\nstring message\nstring hardware_id\n"
               "diagnostic_msgs/KeyValue[] values\n"},
    Definition{"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    Definition{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"sensor_msgs/RegionOfInterest",
               "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    Definition{"sensor_msgs/NavSatStatus", "int8 status\nuint16 service\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Pose",
               "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{"geometry_msgs/PoseWithCovariance",
               "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/Twist",
               "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    Definition{"geometry_msgs/TwistWithCovariance",
               "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/Transform",
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{"geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\n"
               "geometry_msgs/Transform transform\n"},
};

const Definition& find(std::string_view name) {
  return *std::ranges::find(kDefinitions, name, &Definition::name);
}

/// Types of the fields of a definition.
std::vector<std::string_view> parts(std::string_view fields) {
  std::vector<std::string_view> out;
  while (!fields.empty()) {
    const std::size_t end = fields.find('\n');
    std::string_view type = fields.substr(0, fields.find(' '));
    type = type.substr(0, type.find('['));
    if (type.find('/') != std::string_view::npos) out.push_back(type);
    fields.remove_prefix(end + 1);
  }
  return out;
}

}  // namespace

std::uint32_t crc32_of(std::span<const std::uint8_t> bytes) noexcept {
  return libdeflate_crc32(0, bytes.data(), bytes.size());
}

Rectification rectification(const RigCalibration& rig, int camera, bool calibrated) noexcept {
  const auto& lenses = rig.intrinsics;
  const Intrinsics& lens = lenses[static_cast<std::size_t>(camera)];
  Rectification r;
  r.P << lens.fx, 0, lens.cx, 0, 0, lens.fy, lens.cy, 0, 0, 0, 1, 0;
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
  const double focal = (lenses[0].fx + lenses[0].fy + lenses[other].fx + lenses[other].fy) / 4;
  r.R = camera == 0 ? R_common_left : Mat3(R_common_left * T_other_left.R.transpose());
  const double offset = camera == 0 ? 0 : -focal * centre.norm();
  r.P << focal, 0, lenses[0].cx, offset, 0, focal, lenses[0].cy, 0, 0, 0, 1, 0;
  return r;
}

void write_image(CdrWriter* out, Stamp stamp, std::string_view frame,
                 const ImageView& image) noexcept {
  const auto width = static_cast<std::uint32_t>(image.width);
  const auto height = static_cast<std::uint32_t>(image.height);
  out->header(stamp, frame).put(height).put(width).text("mono8").boolean(false).put(width);
  out->count(std::size_t{width} * height);
  for (int y = 0; y < image.height; ++y) out->raw({image.row(y), width});
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
  for (int i = 0; i < 12; ++i) out->put(r.P(i / 4, i % 4));
  // Binning and region of interest are 0 for the full sensor.
  for (int i = 0; i < 6; ++i) out->put(std::uint32_t{0});
  out->boolean(false);
}

void write_nav_sat_fix(CdrWriter* out, Stamp stamp, std::string_view frame,
                       const FixMessage& fix) noexcept {
  out->header(stamp, frame);
  constexpr std::uint16_t kGps = 1;
  out->put(static_cast<std::int8_t>(fix.fix ? 0 : -1)).put(kGps);
  out->put(fix.position.latitude_deg).put(fix.position.longitude_deg).put(fix.position.height_m);
  out->items(fix.covariance).put(static_cast<std::uint8_t>(fix.known));
}

void write_nav_sat_fix(CdrWriter* out, const InsSample& s) noexcept {
  FixMessage fix{.fix = s.fix == FixStatus::fix_2d || s.fix == FixStatus::fix_3d,
                 .position = s.position};
  fix.covariance[0] = fix.covariance[4] = s.position_sigma * s.position_sigma;
  fix.covariance[8] = s.height_sigma * s.height_sigma;
  if (s.position_sigma > 0) fix.known = FixMessage::Known::diagonal;
  write_nav_sat_fix(out, s.stamp, "ins", fix);
}

void write_imu(CdrWriter* out, const InsSample& s) noexcept {
  out->header(s.stamp, "ins").items(s.q_enu_ins);
  const double tilt = s.tilt_sigma * s.tilt_sigma;
  out->items(s.attitude_valid ? std::array{tilt, 0.0, 0.0, 0.0, tilt, 0.0, 0.0, 0.0,
                                           s.heading_sigma * s.heading_sigma}
                              : kNotMeasured);
  // Rates and accelerations are not measured.
  for (int i = 0; i < 2; ++i) {
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

void write_odometry(CdrWriter* out, Stamp stamp, std::string_view frame, std::string_view child,
                    const OdometryMessage& odometry) noexcept {
  out->header(stamp, frame).text(child);
  put_pose(out, odometry.pose);
  out->items(odometry.pose_covariance);
  put_vector(out, odometry.linear);
  put_vector(out, odometry.angular);
  out->items(odometry.twist_covariance);
}

void write_odometry(CdrWriter* out, const PoseSample& sample) noexcept {
  OdometryMessage odometry{.pose_covariance = full_matrix(sample.covariance)};
  if (sample.status != PoseStatus::lost)
    odometry.pose = sample.T_world_left;
  else
    odometry.pose_covariance[0] = -1.0;
  // The twist is not measured.
  odometry.twist_covariance[0] = -1.0;
  write_odometry(out, sample.stamp, "world", "left", odometry);
}

void write_pose_with_covariance(CdrWriter* out, Stamp stamp, std::string_view frame,
                                const Transform& pose,
                                const std::array<double, 36>& covariance) noexcept {
  out->header(stamp, frame);
  put_pose(out, pose);
  out->items(covariance);
}

void write_transforms(CdrWriter* out, Stamp stamp,
                      std::span<const NamedTransform> transforms) noexcept {
  out->count(transforms.size());
  for (const NamedTransform& t : transforms) {
    out->header(stamp, t.parent).text(t.child);
    put_pose(out, t.T_parent_child);
  }
}

void write_pose_transform(CdrWriter* out, const PoseSample& sample) noexcept {
  write_transforms(out, sample.stamp,
                   std::array{NamedTransform{"world", "left", sample.T_world_left}});
}

void write_rig_transforms(CdrWriter* out, Stamp stamp, const RigCalibration& rig,
                          std::span<const std::string> names) noexcept {
  std::array<NamedTransform, kMaxCameras> transforms;
  const auto cameras = std::min(static_cast<std::size_t>(rig.cameras), names.size());
  for (std::size_t k = 1; k < cameras; ++k)
    transforms[k - 1] = {names[0], names[k], rig.T_camera_left[k].inverse()};
  write_transforms(out, stamp, std::span(transforms).first(cameras > 0 ? cameras - 1 : 0));
}

void write_diagnostics(CdrWriter* out, Stamp stamp,
                       std::span<const DiagnosticMessage> diagnostics) noexcept {
  out->header(stamp, "").count(diagnostics.size());
  for (const DiagnosticMessage& d : diagnostics) {
    out->put(static_cast<std::uint8_t>(d.level)).text(d.name).text(d.message).text("vergence");
    out->count(d.values.size());
    for (const auto& [key, value] : d.values) out->text(key).text(value);
  }
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
  put_pose(out, s.T_world_left);
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

std::string_view ros_type_name(RosType type) noexcept {
  return kDefinitions[static_cast<std::size_t>(type)].name;
}

std::string ros_definition(RosType type) {
  const std::string_view fields = kDefinitions[static_cast<std::size_t>(type)].fields;
  std::string text(fields);
  std::vector<std::string_view> open = parts(fields);
  std::set<std::string_view> written;
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (!written.insert(open[i]).second) continue;
    const Definition& part = find(open[i]);
    text += fmt::format("{:=<80}\nMSG: {}\n{}", "", part.name, part.fields);
    const auto more = parts(part.fields);
    open.insert(open.end(), more.begin(), more.end());
  }
  return text;
}

}  // namespace vergence::app
