#include "tests/system/odometry/mock_drive.hpp"

#include <memory>

#include "drivers/mock/world/renderer.hpp"

namespace vergence::test {
namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr double kBaseline = 0.75;  // m
constexpr Duration kInterval = Duration::milliseconds(50);
constexpr Stamp kStart{1'700'000'000'000'000'000};

RigCalibration make_rig() {
  RigCalibration rig;
  rig.cameras = 2;
  rig.baseline = kBaseline;
  for (std::size_t k = 0; k < 2; ++k) {
    Intrinsics& c = rig.intrinsics[k];
    c.width = kWidth;
    c.height = kHeight;
    c.fx = c.fy = 550.0;
    c.cx = k == 0 ? 318.7 : 323.1;
    c.cy = k == 0 ? 241.2 : 237.9;
    c.distortion = {-0.21, 0.06, 0.0004, -0.0003, 0};
  }
  rig.T_camera_left[1] = {exp_so3(Vec3(0.004, -0.006, 0.003)), Vec3(-kBaseline, 0.003, 0.005)};
  return rig;
}

std::shared_ptr<const mock::World> world() {
  static const auto made = [] {
    mock::WorldOptions options;
    options.texture_detail = 1;
    return std::make_shared<const mock::World>(options);
  }();
  return made;
}

}  // namespace

StereoDrive render_drive(const mock::DriveOptions& options, Duration from, std::size_t frames) {
  return render_drive(options, from, frames, make_rig());
}

StereoDrive render_drive(const mock::DriveOptions& options, Duration from, std::size_t frames,
                         const RigCalibration& rig) {
  const mock::Drive drive(options, *world());
  StereoDrive out;
  out.rig = rig;
  std::array<mock::Renderer, 2> renderers{mock::Renderer(world(), Camera(out.rig.intrinsics[0])),
                                          mock::Renderer(world(), Camera(out.rig.intrinsics[1]))};
  for (std::size_t i = 0; i < frames; ++i) {
    const Duration since = kInterval * static_cast<std::int64_t>(i);
    const Transform T_left_enu =
        mock::camera_pose(drive.at(from + since), mock::default_T_body_left());
    std::array<OwnedImage, 2> pair;
    for (std::size_t k = 0; k < 2; ++k) {
      pair[k] = OwnedImage(rig.intrinsics[k].width, rig.intrinsics[k].height);
      mock::RenderRequest shot;
      shot.noise_seed = static_cast<std::uint32_t>(2 * i + k + 1);
      renderers[k].render(out.rig.T_camera_left[k] * T_left_enu, shot, pair[k].bytes.data(),
                          pair[k].stride);
    }
    out.stamps.push_back(kStart + since);
    out.pairs.push_back(std::move(pair));
    out.truth.push_back(T_left_enu.inverse());
  }
  return out;
}

const StereoDrive& brief_drive() {
  static const StereoDrive drive = [] {
    mock::DriveOptions options;
    options.kind = mock::DriveKind::brief;
    options.speed = 9.0;
    options.stop_s = 1.0;
    return render_drive(options, Duration::milliseconds(500), 240);
  }();
  return drive;
}

const StereoDrive& still_drive() {
  static const StereoDrive drive = [] {
    mock::DriveOptions options;
    options.kind = mock::DriveKind::still;
    return render_drive(options, Duration{}, 60);
  }();
  return drive;
}

}  // namespace vergence::test
