#include "tests/support/kitti_raw_writer.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "app/devices/rig_settings.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/math/random.hpp"
#include "core/math/so3.hpp"
#include "tests/support/mock_source.hpp"

namespace vergence::test {
namespace {

namespace fs = std::filesystem;

const std::string kDate = "2020_01_01";
constexpr Duration kRightIsEarly = Duration::microseconds(1300);
constexpr double kDegree = std::numbers::pi / 180;

std::string stamp_line(Stamp stamp) {
  const std::time_t seconds = stamp.ns() / 1'000'000'000;
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:09d}\n", fmt::gmtime(seconds),
                     stamp.ns() % 1'000'000'000);
}

std::string numbers(std::initializer_list<double> values) {
  std::string text;
  for (const double v : values) text += fmt::format(" {:.17g}", v);
  return text + "\n";
}
std::string numbers(const Mat3& R) {
  return numbers({R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)});
}
std::string numbers(const Vec3& t) { return numbers({t.x(), t.y(), t.z()}); }

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

std::string camera_text(const RigCalibration& rig, std::size_t k) {
  const Intrinsics& c = rig.intrinsics[k];
  const Transform& T = rig.T_camera_left[k];
  const auto& d = c.distortion;
  const double w = c.width, h = c.height;
  const std::array<std::pair<const char*, std::string>, 8> lines{
      {{"S", numbers({w, h})},
       {"K", numbers({c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1})},
       {"D", numbers({d[0], d[1], d[2], d[3], d[4]})},
       {"R", numbers(T.R)},
       {"T", numbers(T.t)},
       {"S_rect", numbers({w, h})},
       {"R_rect", numbers(Mat3(Mat3::Identity()))},
       {"P_rect",
        numbers({c.fx, 0, c.cx, c.fx * T.t.x(), 0, c.fy, c.cy, c.fy * T.t.y(), 0, 0, 1, 0})}}};
  std::string text;
  for (const auto& [name, values] : lines) text += fmt::format("{}_{:02d}:{}", name, k, values);
  return text;
}

/// p_camera0 = T_camera_velo · T_velo_ins · p_ins, with a scanner as the data set has it.
void write_calibration(const app::Configuration& c, const fs::path& folder) {
  const RigCalibration rig = app::nominal_rig(c);
  write(folder / "calib_cam_to_cam.txt",
        "calib_time: 09-Jan-2020 13:57:47\ncorner_dist: 9.95e-02\n" + camera_text(rig, 0) +
            camera_text(rig, 1));
  const Transform T_camera_velo{
      mount_of(Vec3::Zero(), Vec3(0.8, -0.4, 0.2) * kDegree).R.transpose(),
      Vec3(-0.004, -0.076, -0.272)};
  const Transform T_velo_ins =
      T_camera_velo.inverse() * app::comparison_options(c).T_ins_left.inverse();
  write(folder / "calib_velo_to_cam.txt",
        "calib_time: 15-Mar-2020 11:37:16\nR:" + numbers(T_camera_velo.R) +
            "T:" + numbers(T_camera_velo.t) + "delta_f: 0 0\ndelta_c: 0 0\n");
  write(folder / "calib_imu_to_velo.txt", "calib_time: 25-May-2020 16:47:16\nR:" +
                                              numbers(T_velo_ins.R) + "T:" + numbers(T_velo_ins.t));
}

/// Errors of a unit with RTK.
class OxtsErrors {
 public:
  explicit OxtsErrors(std::uint64_t seed) : random_(seed, 77) {
    for (std::size_t i = 0; i < wander_.size(); ++i) wander_[i] = random_.normal();
  }
  void spoil(InsSample* s) {
    const double dt = last_.ns() > 0 ? (s->stamp - last_).to_seconds() : 0;
    last_ = s->stamp;
    for (std::size_t i = 0; i < wander_.size(); ++i) {
      const double memory = std::exp(-dt / (i < 3 ? 20.0 : 60.0));
      wander_[i] = memory * wander_[i] + std::sqrt(1 - memory * memory) * random_.normal();
    }
    const LocalTangentPlane plane(s->position);
    const auto place = [this](std::size_t i, double size) {
      return size * (0.03 * wander_[i] + 0.01 * random_.normal());
    };
    s->position = plane.to_geodetic({place(0, 1), place(1, 1), place(2, 2)});
    for (double& v : s->velocity_enu) v += 0.02 * random_.normal();
    const Mat3 R =
        Eigen::Quaterniond(s->q_enu_ins[3], s->q_enu_ins[0], s->q_enu_ins[1], s->q_enu_ins[2])
            .toRotationMatrix();
    const Mat3 turned = exp_so3(Vec3(0, 0, 0.1 * kDegree * wander_[5])) * R *
                        exp_so3(Vec3(0.03 * kDegree * wander_[3], 0.03 * kDegree * wander_[4], 0));
    const Eigen::Quaterniond q = quaternion(turned);
    s->q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
    s->stamp = s->stamp + Duration::seconds(0.002 * random_.normal());
  }

 private:
  Random random_;
  std::array<double, 6> wander_{};  // east, north, up, roll, pitch, heading; in sigmas
  Stamp last_{};
};

std::string packet(const InsSample& s) {
  const Mat3 R = Eigen::Quaterniond(s.q_enu_ins[3], s.q_enu_ins[0], s.q_enu_ins[1], s.q_enu_ins[2])
                     .toRotationMatrix();
  const double roll = std::atan2(R(2, 1), R(2, 2)), pitch = std::asin(-R(2, 0)),
               yaw = std::atan2(R(1, 0), R(0, 0));
  const auto& [east, north, up] = s.velocity_enu;
  const double forward = std::cos(yaw) * east + std::sin(yaw) * north,
               left = -std::sin(yaw) * east + std::cos(yaw) * north;
  return fmt::format(
      "{:.13f} {:.13f} {:.7f} {:.12f} {:.12f} {:.12f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} 0 0 9.81 "
      "0 0 9.81 0 0 0 0 0 0 "
      "0.03 0.02 4 9 5 5 5\n",
      s.position.latitude_deg, s.position.longitude_deg, s.position.height_m, roll, pitch, yaw,
      north, east, forward, left, up);
}

/// The folders and lists of one drive while it is written.
struct Written {
  fs::path drive;
  std::array<std::string, 2> times{};
  std::string oxts_times{};
  int images = 0, packets = 0;
};

void write_images(const RigFrame& frame, Written* w) {
  for (int k = 0; k < 2; ++k) {
    const ImageView& v = frame.images[static_cast<std::size_t>(k)];
    const cv::Mat image(v.height, v.width, CV_8U, const_cast<std::uint8_t*>(v.row(0)),
                        static_cast<std::size_t>(v.stride));
    (void)cv::imwrite(
        (w->drive / fmt::format("image_{:02d}/data/{:010d}.png", k, w->images)).string(), image,
        {cv::IMWRITE_PNG_COMPRESSION, 1});
    w->times[static_cast<std::size_t>(k)] +=
        stamp_line(k == 0 ? frame.stamp : frame.stamp - kRightIsEarly);
  }
  ++w->images;
}

}  // namespace

fs::path write_kitti_raw(const app::Configuration& c, double duration_s, const KittiRawForm& form,
                         const fs::path& folder) {
  const app::MockDrive drive = app::make_mock_drive(c, {}, false, duration_s, false);
  Acquisition source({&drive.rig->camera(0), &drive.rig->camera(1)}, &drive.rig->ins(),
                     &drive.rig->trigger(), mock_source_options(c, drive));

  Written w;
  w.drive = folder / kDate / (kDate + "_drive_0001_" + (form.rectified ? "sync" : "extract"));
  for (const char* below : {"image_00/data", "image_01/data", "oxts/data"})
    fs::create_directories(w.drive / below);
  write_calibration(c, folder / kDate);
  OxtsErrors errors(form.seed);
  if (source.start()) throw std::runtime_error("the mock does not start");
  for (Acquired item; source.next(&item);) {
    if (const auto* reading = std::get_if<AcquiredReading>(&item)) {
      InsSample s = reading->sample;
      if (form.noisy_oxts) errors.spoil(&s);
      write(w.drive / fmt::format("oxts/data/{:010d}.txt", w.packets++), packet(s));
      w.oxts_times += stamp_line(s.stamp);
    }
    const auto* frame = std::get_if<AcquiredFrame>(&item);
    if (frame == nullptr) continue;
    if (frame->set.complete) write_images(frame->rig, &w);
    source.release(*frame);
  }
  source.join();
  for (int k = 0; k < 2; ++k)
    write(w.drive / fmt::format("image_{:02d}/timestamps.txt", k),
          w.times[static_cast<std::size_t>(k)]);
  write(w.drive / "oxts/timestamps.txt", w.oxts_times);
  return w.drive;
}

}  // namespace vergence::test
