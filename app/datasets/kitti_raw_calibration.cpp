#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/detail/kitti_raw.hpp"
#include "app/datasets/kitti_calibration.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

std::string key(const char* name, int camera) { return fmt::format("{}_{:02d}", name, camera); }

Intrinsics raw_lens(const KittiCalibrationText& text, int camera) {
  const Mat3 K = text.matrix(key("K", camera));
  std::array<double, 5> distortion{};  // k1 k2 p1 p2 k3
  text.read(key("D", camera), &distortion);
  Intrinsics lens;
  lens.fx = K(0, 0), lens.fy = K(1, 1), lens.cx = K(0, 2), lens.cy = K(1, 2);
  lens.distortion = distortion;
  if (!(lens.fx > 0 && lens.fy > 0) || K(0, 1) != 0 || K(1, 0) != 0 || K(2, 2) != 1)
    refuse(text.file(), text.line_of(key("K", camera)),
           key("K", camera) + ": is not [fx 0 cx; 0 fy cy; 0 0 1] with positive focal lengths");
  return lens;
}

/// Where a camera sits, from camera 00 before rectification, and how it sees.
struct Camera {
  Intrinsics lens{};
  Transform T_camera_camera0{};
};

Camera camera_of(const KittiCalibrationText& text, int number, bool rectified) {
  Camera c;
  if (!rectified) {
    c.lens = raw_lens(text, number);
    c.T_camera_camera0 = {text.rotation(key("R", number)), text.vector(key("T", number))};
    return c;
  }
  const std::string name = key("P_rect", number);
  std::array<double, 12> P{};
  text.read(name, &P);
  c.lens = rectified_camera(P, &c.T_camera_camera0.t, text.file(), text.line_of(name));
  c.T_camera_camera0.R =
      text.rotation(key("R_rect", 0));  // all were turned into the axes of camera 00 as it became
  return c;
}

Transform rigid_of(const std::filesystem::path& file) {
  const KittiCalibrationText text(
      file, ", or say by `--set ins.lever_arm_m=[…]` where the left camera sits in the INS's body");
  return {text.rotation("R"), text.vector("T")};
}

}  // namespace

KittiRawRig read_kitti_raw_rig(const std::filesystem::path& file, const std::array<int, 2>& cameras,
                               ImageSize images, const std::string& drive_name) {
  const KittiCalibrationText text(file, ", or give one with --calibration");
  KittiRawRig out;
  const ImageSize raw = text.size(key("S", cameras[0])),
                  rectified = text.size(key("S_rect", cameras[0]));
  if (images != raw && images != rectified)
    refuse(file, text.line_of(key("S", cameras[0])),
           fmt::format("is for images of {}x{} pixels, or {}x{} rectified, but those of the drive "
                       "have {}x{}; use the calibration of its date",
                       raw.width, raw.height, rectified.width, rectified.height, images.width,
                       images.height));
  out.rectified = images == rectified && (images != raw || drive_name.ends_with("_sync"));
  std::array<Camera, 2> both;
  for (std::size_t k = 0; k < 2; ++k) {
    both[k] = camera_of(text, cameras[k], out.rectified);
    const ImageSize size = text.size(key(out.rectified ? "S_rect" : "S", cameras[k]));
    both[k].lens.width = size.width, both[k].lens.height = size.height;
  }
  out.T_left_camera0 = both[0].T_camera_camera0;
  out.rig.cameras = 2;
  out.rig.intrinsics = {both[0].lens, both[1].lens};
  out.rig.T_camera_left[1] = both[1].T_camera_camera0 * both[0].T_camera_camera0.inverse();
  if (out.rectified)
    out.rig.T_camera_left[1].R = Mat3::Identity();  // without the rounding of a product
  out.rig.baseline = out.rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&out.rig)) refuse(file, 0, bad->sentence);
  return out;
}

Transform read_kitti_raw_mount(const std::filesystem::path& folder) {
  return rigid_of(folder / "calib_velo_to_cam.txt") * rigid_of(folder / "calib_imu_to_velo.txt");
}

}  // namespace vergence::app::detail
