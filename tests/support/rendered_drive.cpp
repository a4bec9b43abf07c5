#include "tests/support/rendered_drive.hpp"

#include <thread>

#include "core/camera/camera.hpp"
#include "drivers/mock/rig_truth.hpp"
#include "tests/support/parallel_rig.hpp"

namespace vergence::test {
namespace {

constexpr Stamp kStart{1'700'000'000'000'000'000};

std::shared_ptr<const mock::World> world() {
  static const auto made = std::make_shared<const mock::World>(mock::WorldOptions{});
  return made;
}

}  // namespace

RigCalibration paper_rig() {
  RigCalibration rig{.cameras = 2};
  constexpr auto kModel = CameraModelKind::pinhole_radtan;
  rig.intrinsics[0] = {
      kModel, 1024, 768, 1246.561673900704, 1247.092336797580, 532.287936343425, 383.604069688392};
  rig.intrinsics[1] = {
      kModel, 1024, 768, 1244.805048771648, 1245.815687282771, 506.635543659909, 390.704813552426};
  Transform& T = rig.T_camera_left[1];
  T.R << 0.999985020769994, 0.001356661749366, -0.005302612991045, -0.001329315763428,
      0.999985817981778, 0.005157204176297, 0.005309534370930, -0.005150078078314,
      0.999972642396056;
  T.t = {-0.7506666877284111, -0.003857678457065100, 0.0030959446910902};
  rig.baseline = T.t.norm();
  return rig;
}

RigCalibration nominal_rig() {
  Intrinsics lens = pinhole(640, 480, 0.72 * 640);
  lens.distortion = {-0.08, 0.02, 0, 0, 0};
  return parallel_rig(lens, 0.75);
}

struct RenderedDrive::Parts {
  explicit Parts(const RenderedDriveOptions& o) : options(o), drive(o.drive, *world()) {
    for (int k = 0; k < o.rig.cameras; ++k) {
      const Intrinsics& c = o.rig.intrinsics[static_cast<std::size_t>(k)];
      renderers.emplace_back(world(), Camera(c));
      stride.push_back((c.width + 63) / 64 * 64);
      pixels.emplace_back(static_cast<std::size_t>(stride.back()) *
                          static_cast<std::size_t>(c.height));
    }
    frame.cameras = o.rig.cameras;
  }
  /// Into the drive, of frame i.
  [[nodiscard]] Duration time(std::uint64_t i) const {
    return Duration::seconds(options.from_s + static_cast<double>(i) / options.rate);
  }

  RenderedDriveOptions options;
  mock::Drive drive;
  std::vector<mock::Renderer> renderers;
  std::vector<std::ptrdiff_t> stride;
  std::vector<std::vector<std::uint8_t>> pixels;
  RigFrame frame;
};

RenderedDrive::RenderedDrive(const RenderedDriveOptions& options)
    : parts_(std::make_unique<Parts>(options)) {}
RenderedDrive::~RenderedDrive() = default;
const RigCalibration& RenderedDrive::rig() const noexcept { return parts_->options.rig; }

Transform RenderedDrive::T_camera_left(int k, std::uint64_t i) const {
  if (k > 0 && parts_->options.placed) return parts_->options.placed(k, i);
  return parts_->options.rig.T_camera_left[static_cast<std::size_t>(k)];
}

Transform RenderedDrive::T_enu_left(std::uint64_t i) const {
  return mock::camera_pose(parts_->drive.at(parts_->time(i)), mock::default_T_body_left())
      .inverse();
}

const RigFrame& RenderedDrive::frame(std::uint64_t i) {
  Parts& p = *parts_;
  const Transform T_left_enu = T_enu_left(i).inverse();
  const auto render = [&](int k) {
    const auto c = static_cast<std::size_t>(k);
    mock::RenderRequest shot{.noise_seed = static_cast<std::uint32_t>(i * kMaxCameras + c + 1)};
    p.renderers[c].render(T_camera_left(k, i) * T_left_enu, shot, p.pixels[c].data(), p.stride[c]);
    const Intrinsics& size = p.options.rig.intrinsics[c];
    p.frame.images[c] = {p.pixels[c].data(), size.width, size.height, p.stride[c]};
  };
  std::thread others([&] {
    for (int k = 1; k < p.options.rig.cameras; ++k) render(k);
  });
  render(0);
  others.join();
  p.frame.number = i;
  p.frame.stamp = kStart + Duration::seconds(static_cast<double>(i) / p.options.rate);
  return p.frame;
}

std::vector<double> RenderedDrive::starts(const mock::DriveOptions& options, int count,
                                          double speed, double seconds) {
  const mock::Drive drive(options, *world());
  std::vector<double> possible;
  constexpr double kStep = 0.25;
  const double end = drive.duration().to_seconds() - seconds;
  for (double t = 0; t < end; t += kStep) {
    bool fast = true;
    for (double u = t; fast && u < t + seconds; u += kStep)
      fast = drive.at(Duration::seconds(u)).velocity.norm() >= speed;
    if (fast) possible.push_back(t);
  }
  std::vector<double> chosen;
  for (int i = 0; i < count && !possible.empty(); ++i)
    chosen.push_back(
        possible[possible.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count)]);
  return chosen;
}

}  // namespace vergence::test
