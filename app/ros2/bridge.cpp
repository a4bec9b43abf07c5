#include "app/ros2/bridge.hpp"

#include <nlohmann/json.hpp>

#include "app/runtime/errors.hpp"
#include "app/runtime/nearest.hpp"
#include "app/runtime/transform_rows.hpp"
#include "core/comparison/comparison.hpp"

namespace vergence::app::ros2 {
namespace {

using nlohmann::json;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// In m², rad² and for speeds: large enough for a filter to ignore the value.
constexpr double kUnknownVariance = 1e6;
// Cameras whose images are published.
constexpr std::size_t kImages = 2;
// Maximum time in s between two poses for a measured speed.
constexpr double kLongestStep = 1;

/// Factor on the standard deviations of a degraded pose (docs/ros2.md).
double sigma_factor(std::string_view reason) {
  // The motion was extrapolated, not measured.
  for (const std::string_view r : {"time_gap", "map_reset", "no_image"})
    if (reason == r) return 10;
  // The scale depends on a calibration that is not, or not yet, that of the rig.
  for (const std::string_view r :
       {"unverified_calibration", "recalibrating", "uncalibrated", "single_camera", "out_of_sync",
        "no_stereo_matches", "cameras_swapped"})
    if (reason == r) return 3;
  return reason.empty() ? 1 : 2;
}

Vec3 vector(const json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

Transform transform(const json& rows) { return transform_of(rows.get<std::array<double, 12>>()); }

/// Covariance from the 21 numbers of the upper triangle; unknown if null.
Matrix6 covariance(const json& upper) {
  Matrix6 m = kUnknownVariance * Matrix6::Identity();
  if (upper.is_null()) return m;
  std::size_t next = 0;
  for (int i = 0; i < 6; ++i)
    for (int k = i; k < 6; ++k) m(i, k) = m(k, i) = upper.at(next++);
  return m;
}

std::array<double, 36> items(const Matrix6& m) {
  std::array<double, 36> out;
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(out.data()) = m;
  return out;
}

/// Returns [A B; 0 C].
Matrix6 blocks(const Mat3& A, const Mat3& B, const Mat3& C) {
  Matrix6 m = Matrix6::Zero();
  m << A, B, Mat3::Zero(), C;
  return m;
}

/// Axes forward, left, up from the optical axes (right, down, forward).
Transform forward_left_up() { return mount_of(Vec3::Zero(), Vec3::Zero()); }

/// Part of a topic or frame for a camera's name: letters, digits and underscores.
std::string ros_name(std::string name) {
  for (char& c : name)
    if (!(c >= '0' && c <= '9') && !(c >= 'a' && c <= 'z') && !(c >= 'A' && c <= 'Z')) c = '_';
  return name.empty() || (name[0] >= '0' && name[0] <= '9') ? "_" + name : name;
}

std::string optical_frame(const std::string& camera) { return camera + "_optical_frame"; }

using Level = DiagnosticMessage::Level;

std::string text(const json& value) {
  if (value.is_null()) return "unknown";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

DiagnosticMessage odometry_status(const json& line) {
  DiagnosticMessage d{Level::ok, "vergence: odometry", text(line.at("status")), {}};
  const json& status = line.at("status");
  if (status == "degraded") d.level = Level::warn;
  if (status == "lost") d.level = Level::error;
  if (status == "degraded" || status == "lost") d.message += ": " + text(line.at("reason"));
  constexpr double kSilentS = 1;
  if (status.is_null() || line.at("silent_s").get<double>() > kSilentS) {
    d.level = Level::stale;
    d.message = status.is_null()
                    ? "no frame yet"
                    : fmt::format("no frames for {:.1f} s", line.at("silent_s").get<double>());
  }
  for (const char* key : {"session", "state", "status", "reason"})
    d.values.emplace_back(key, text(line.at(key)));
  if (line.at("frames").is_object())
    for (const auto& [key, value] : line.at("frames").items())
      d.values.emplace_back("frames " + key, text(value));
  return d;
}

DiagnosticMessage calibration_status(const json& line, const std::string& rating) {
  const bool calibrated = line.at("calibrated"), verified = line.at("verified");
  DiagnosticMessage d{Level::ok, "vergence: calibration", "verified", {}};
  if (!verified) {
    d.level = Level::warn;
    d.message = calibrated ? "not verified" : "none yet; drive to calibrate";
  } else if (!rating.empty()) {
    d.message = "verified; rating: " + rating;
    if (rating != "good") d.level = rating == "poor" ? Level::error : Level::warn;
  }
  d.values = {{"verified", text(line.at("verified"))},
              {"rating", rating.empty() ? "unknown" : rating}};
  return d;
}

DiagnosticMessage cameras_status(const json& line) {
  const json& pairing = line.at("pairing");
  DiagnosticMessage d{Level::ok, "vergence: cameras", "pairing " + text(pairing), {}};
  if (pairing == "contradicted") d.level = Level::warn;
  std::size_t k = 0;
  for (const json& present : line.at("cameras")) {
    const std::string name = fmt::format("camera {}", k++);
    d.values.emplace_back(name, present.get<bool>() ? "image" : "no image");
    if (present) continue;
    d.level = Level::error;
    d.message = name + " gives no image";
  }
  return d;
}

DiagnosticMessage ins_status(const json& line) {
  DiagnosticMessage d{Level::ok, "vergence: INS", "no INS, or no sample yet", {}};
  const json& ins = line.at("ins");
  if (ins.is_null()) return d;
  constexpr double kSilentS = 2;
  const double silent = ins.at("silent_s");
  d.message =
      "fix " + text(ins.at("fix")) + (ins.at("aligned") ? ", aligned" : ", not aligned yet");
  if (ins.at("fix") == "none" || ins.at("fix") == "dead_reckoning") d.level = Level::warn;
  if (silent > kSilentS) {
    d.level = Level::error;
    d.message = fmt::format("no sample for {:.1f} s", silent);
  }
  for (const auto& [key, value] : ins.items()) d.values.emplace_back(key, text(value));
  return d;
}

DiagnosticMessage stream_status(std::uint64_t dropped, std::uint64_t malformed) {
  return {malformed > 0 ? Level::warn : Level::ok,
          "vergence: pose stream",
          malformed > 0 ? "malformed lines" : "connected",
          {{"dropped lines", fmt::format("{}", dropped)},
           {"malformed lines", fmt::format("{}", malformed)}}};
}

}  // namespace

Bridge::Bridge(const BridgeOptions& options, TopicWriter* writer)
    : options_(options),
      writer_(writer),
      T_odom_world_(options.camera_child ? forward_left_up() : options.T_base_left),
      T_left_child_(options.camera_child ? Transform{} : options.T_base_left.inverse()),
      child_frame_(options.camera_child ? optical_frame("left") : options.base_frame),
      odometry_topic_(options.name_space + "/odometry"),
      fix_topic_(options.name_space + "/fix"),
      pose_enu_topic_(options.name_space + "/pose_enu"),
      buffer_(std::size_t{16} << 10) {
  writer_->advertise(odometry_topic_, RosType::odometry, false);
  if (options_.publish_tf) writer_->advertise("/tf", RosType::tf, false);
  writer_->advertise("/tf_static", RosType::tf, true);
  writer_->advertise(fix_topic_, RosType::nav_sat_fix, false);
  writer_->advertise(pose_enu_topic_, RosType::pose_with_covariance, false);
  writer_->advertise("/diagnostics", RosType::diagnostics, false);
}

/// The buffer grows until the message fits, because texts of diagnostics have any length.
template <class Write>
void Bridge::publish(const std::string& topic, const Write& write) {
  for (;; buffer_.resize(2 * buffer_.size())) {
    CdrWriter out(buffer_);
    write(&out);
    if (out.ok()) return writer_->publish(topic, out.written());
  }
}

std::optional<Bridge::Response> Bridge::add(std::string_view text) {
  try {
    const json line = json::parse(text);
    if (const json& version = line.at("version"); version != kVersion)
      throw InputError(
          "pose stream: vergence sends version {}, vergence-ros2 reads version {}; install both "
          "packages in the same version",
          version.dump(), kVersion);
    const std::string& type = line.at("type").get_ref<const std::string&>();
    if (type == "pose") on_pose(line);
    if (type == "calibration" && text != calibration_text_) {
      on_calibration(line);
      calibration_text_ = text;
    }
    if (type == "alignment") on_alignment(line);
    if (type == "status") on_status(line);
    if (type == "response")
      return Response{line.at("accepted").get<bool>(), line.at("message").get<std::string>()};
  } catch (const json::exception&) {
    ++malformed_;
  }
  return std::nullopt;
}

void Bridge::on_pose(const json& line) {
  dropped_ = line.at("dropped");
  const json& pose = line.at("pose");
  if (line.at("status") == "lost" || pose.is_null()) return previous_.reset();
  const Vec3 position = vector(pose.at("position_m"));
  const json& q = pose.at("orientation_xyzw");
  const Transform T_world_left{Eigen::Quaterniond(q.at(3).get<double>(), q.at(0).get<double>(),
                                                  q.at(1).get<double>(), q.at(2).get<double>())
                                   .normalized()
                                   .toRotationMatrix(),
                               position};
  const PosedChild now{Stamp(line.at("stamp_ns").get<std::int64_t>()),
                       T_odom_world_ * T_world_left * T_left_child_};
  const double factor = sigma_factor(line.at("reason").get_ref<const std::string&>());
  const double widening = factor * factor;

  // A rotation of the camera about the world's axes also moves the child, which is offset from it.
  const Vec3 lever = T_world_left.R * T_left_child_.t;
  const Mat3& R = T_odom_world_.R;
  const Matrix6 J = blocks(Mat3::Identity(), -skew(lever), Mat3::Identity());
  const Matrix6 in_world = widening * J * covariance(line.at("covariance")) * J.transpose();
  const Matrix6 turn = blocks(R, Mat3::Zero(), R);

  OdometryMessage odometry{.pose = now.T_odom_child,
                           .pose_covariance = items(turn * in_world * turn.transpose())};
  measure_twist(line, now, widening, &odometry);
  publish(odometry_topic_, [&](CdrWriter* out) {
    write_odometry(out, now.stamp, options_.odom_frame, child_frame_, odometry);
  });
  if (options_.publish_tf)
    publish("/tf", [&](CdrWriter* out) {
      write_transforms(
          out, now.stamp,
          std::array{NamedTransform{options_.odom_frame, child_frame_, now.T_odom_child}});
    });
  if (alignment_) publish_in_enu(now.stamp, T_world_left, in_world);
  previous_ = now;
}

/// Mean motion since the previous pose, about the child's axes.
void Bridge::measure_twist(const json& line, const PosedChild& now, double widening,
                           OdometryMessage* odometry) const {
  const double dt = previous_ ? (now.stamp - previous_->stamp).to_seconds() : 0;
  const json& motion = line.at("motion_covariance");
  if (!(dt > 0 && dt <= kLongestStep) || motion.is_null()) {
    odometry->twist_covariance = items(kUnknownVariance * Matrix6::Identity());
    return;
  }
  const Transform T_before_now = previous_->T_odom_child.inverse() * now.T_odom_child;
  const Vec3 turn = log_so3(T_before_now.R);
  // The chord of an arc in the axes at its middle is the constant velocity along it, to second
  // order.
  odometry->linear = exp_so3(-0.5 * turn) * T_before_now.t / dt;
  odometry->angular = turn / dt;
  const Transform T_child_left = T_left_child_.inverse();
  const Mat3& R = T_child_left.R;
  const Matrix6 J = blocks(R, skew(T_child_left.t) * R, R);
  Matrix6 twist = J * covariance(motion) * J.transpose() / (dt * dt);
  const double length_sigma = line.at("length_sigma");
  twist.topLeftCorner<3, 3>() +=
      length_sigma * length_sigma * odometry->linear * odometry->linear.transpose();
  odometry->twist_covariance = items(widening * twist);
}

void Bridge::publish_in_enu(Stamp stamp, const Transform& T_world_left, const Matrix6& in_world) {
  const Transform T_enu_child = alignment_->T_enu_world * T_world_left * T_left_child_;
  const Mat3& R = alignment_->T_enu_world.R;
  const Matrix6 turn = blocks(R, Mat3::Zero(), R);
  Matrix6 P = turn * in_world * turn.transpose();
  // The alignment rotates the path about the position of its fit, near the odometry's start.
  const Mat3 lever = skew(T_enu_child.t - alignment_->T_enu_world.t);
  P.topLeftCorner<3, 3>() += alignment_->position_variance.asDiagonal();
  P.topLeftCorner<3, 3>() += lever * alignment_->rotation_variance.asDiagonal() * lever.transpose();
  P.bottomRightCorner<3, 3>() += alignment_->rotation_variance.asDiagonal();
  publish(pose_enu_topic_, [&](CdrWriter* out) {
    write_pose_with_covariance(out, stamp, options_.enu_frame, T_enu_child, items(P));
  });
  FixMessage fix{.fix = true,
                 .position = alignment_->plane.to_geodetic(T_enu_child.t),
                 .known = FixMessage::Known::all};
  for (int i = 0; i < 9; ++i) fix.covariance[static_cast<std::size_t>(i)] = P(i / 3, i % 3);
  publish(fix_topic_, [&](CdrWriter* out) { write_nav_sat_fix(out, stamp, child_frame_, fix); });
}

void Bridge::on_calibration(const json& line) {
  const Stamp stamp(line.at("stamp_ns").get<std::int64_t>());
  const json& cameras = line.at("cameras");
  if (cameras.empty()) return;
  RigCalibration rig;
  std::vector<std::string> names;
  rig.cameras = static_cast<int>(std::min<std::size_t>(cameras.size(), kMaxCameras));
  for (std::size_t k = 0; k < static_cast<std::size_t>(rig.cameras); ++k) {
    const json& camera = cameras.at(k);
    Intrinsics& lens = rig.intrinsics[k];
    const json& f = camera.at("intrinsics");
    lens.kind = camera.at("model") == "pinhole-radtan" ? CameraModelKind::pinhole_radtan
                                                       : CameraModelKind::pinhole_equidistant;
    lens.width = camera.at("size").at(0);
    lens.height = camera.at("size").at(1);
    lens.fx = f.at(0), lens.fy = f.at(1), lens.cx = f.at(2), lens.cy = f.at(3);
    lens.distortion = camera.at("distortion").get<std::array<double, 5>>();
    rig.T_camera_left[k] = transform(camera.at("T_camera_left"));
    names.push_back(ros_name(camera.at("name").get<std::string>()));
  }
  rig_ = rig;
  names_ = distinct_names(names);
  if (options_.camera_child) child_frame_ = optical_frame(names_[0]);
  rating_ = line.at("rating").is_string() ? line.at("rating").get<std::string>() : "";

  std::vector<std::string> frames;
  for (const std::string& name : names_) frames.push_back(optical_frame(name));
  const std::string& parent = options_.camera_child ? frames[0] : options_.base_frame;
  std::vector<NamedTransform> transforms;
  for (std::size_t k = options_.camera_child ? 1 : 0; k < frames.size(); ++k)
    transforms.push_back(
        {parent, frames[k], T_left_child_.inverse() * rig.T_camera_left[k].inverse()});
  publish("/tf_static", [&](CdrWriter* out) { write_transforms(out, stamp, transforms); });
  for (std::size_t k = 0; k < names_.size(); ++k) {
    writer_->advertise(camera_topic(k, "camera_info"), RosType::camera_info, true);
    publish_camera_info(k, stamp);
    if (options_.images && k < kImages)
      writer_->advertise(camera_topic(k, "image_raw"), RosType::image, false);
  }
}

void Bridge::publish_camera_info(std::size_t camera, Stamp stamp) {
  publish(camera_topic(camera, "camera_info"), [&](CdrWriter* out) {
    write_camera_info(out, stamp, optical_frame(names_[camera]), rig_, static_cast<int>(camera),
                      true);
  });
}

std::size_t Bridge::begin_image(std::string_view text) {
  try {
    const json line = json::parse(text);
    if (line.at("type") != "image") return 0;
    image_ = {line.at("camera").get<std::size_t>(), Stamp(line.at("stamp_ns").get<std::int64_t>()),
              line.at("width").get<int>(), line.at("height").get<int>()};
    return line.at("bytes").get<std::size_t>();
  } catch (const json::exception&) {
    ++malformed_;
    return 0;
  }
}

void Bridge::end_image(std::string_view pixels) {
  const ImageView image{reinterpret_cast<const std::uint8_t*>(pixels.data()), image_.width,
                        image_.height, image_.width};
  if (image.empty() || std::int64_t{image.width} * image.height != std::ssize(pixels)) {
    ++malformed_;
    return;
  }
  if (image_.camera >= std::min(names_.size(), kImages)) return;
  publish_camera_info(image_.camera, image_.stamp);
  publish(camera_topic(image_.camera, "image_raw"), [&](CdrWriter* out) {
    write_image(out, image_.stamp, optical_frame(names_[image_.camera]), image);
  });
}

void Bridge::on_alignment(const json& line) {
  const json& o = line.at("origin");
  Alignment a{.T_enu_world = transform(line.at("T_enu_world")),
              .plane = LocalTangentPlane(Geodetic{o.at("latitude_deg").get<double>(),
                                                  o.at("longitude_deg").get<double>(),
                                                  o.at("height_m").get<double>()}),
              .position_variance = vector(line.at("position_sigma_m")).cwiseAbs2(),
              .rotation_variance = vector(line.at("rotation_sigma_rad")).cwiseAbs2()};
  alignment_ = a;
}

void Bridge::on_status(const json& line) {
  const json& stamp = line.at("stamp_ns");
  const std::array diagnostics{odometry_status(line), calibration_status(line, rating_),
                               cameras_status(line), ins_status(line),
                               stream_status(dropped_, malformed_)};
  ++statuses_;
  publish("/diagnostics", [&](CdrWriter* out) {
    write_diagnostics(out, Stamp(stamp.is_null() ? 0 : stamp.get<std::int64_t>()), diagnostics);
  });
}

void Bridge::publish_stale(Stamp now, const std::string& message) {
  const std::array diagnostics{
      DiagnosticMessage{Level::stale, "vergence: odometry", message, {}},
      DiagnosticMessage{Level::stale, "vergence: pose stream", message, {}}};
  publish("/diagnostics", [&](CdrWriter* out) { write_diagnostics(out, now, diagnostics); });
}

}  // namespace vergence::app::ros2
