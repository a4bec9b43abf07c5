#include "app/datasets/kitti_calibration.hpp"

#include <algorithm>
#include <map>

#include "app/config/calibration_checks.hpp"
#include "app/datasets/detail/names.hpp"
#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// Lines of such a file by their keys.
class Text {
 public:
  /// `without` ends the message about a missing file.
  Text(const std::filesystem::path& file, const char* without) : file_(file) {
    if (!detail::present(file))
      refuse(file, 0, "is missing; unpack the calibration of that date there{}", without);
    // In bytes.
    constexpr std::size_t kLargest = std::size_t{1} << 20U;
    text_ = read_text(file, kLargest);
    Lines lines(text_);
    for (std::string_view line; lines.next(&line);) {
      const std::size_t end = line.find_first_of(": \t");
      if (end == std::string_view::npos) continue;
      std::string_view rest = line.substr(end);
      rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
      if (rest.starts_with(':')) rest.remove_prefix(1);
      found_.insert_or_assign(line.substr(0, end), Line{rest, lines.number()});
    }
  }

  [[nodiscard]] bool has(const std::string& key) const { return found_.contains(key); }

  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    refuse(file_, found_.at(key).number, key + ": " + what);
  }

  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers(const std::string& key) const {
    const auto found = found_.find(key);
    if (found == found_.end())
      refuse(file_, 0, "has no line `{}:` with {} numbers; check that it is the right file", key,
             N);
    std::array<std::string_view, N> fields;
    const std::size_t count = split(found->second.rest, ' ', fields);
    if (count != N)
      fail(key, fmt::format("has {} numbers instead of {}; check the line", count, N));
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i)
      if (!parse_number(fields[i], &values[i]))
        fail(key, fmt::format("`{}` is not a finite number", fields[i].substr(0, 40)));
    return values;
  }

  [[nodiscard]] Mat3 rotation(const std::string& key) const {
    const auto r = numbers<9>(key);
    const Mat3 R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
    if (!accept_rotation(R))
      fail(key,
           "is not a rotation: it deviates from orthonormal by more than 1e-4; check its numbers");
    return normalised(R);
  }

  [[nodiscard]] Transform rigid(const std::string& R, const std::string& T) const {
    const auto t = numbers<3>(T);
    return {rotation(R), {t[0], t[1], t[2]}};
  }

  [[nodiscard]] ImageSize size(const std::string& key) const {
    const auto v = numbers<2>(key);
    // In px.
    constexpr int kWidest = 1 << 15;
    if (!(v[0] >= 1 && v[0] <= kWidest && v[1] >= 1 && v[1] <= kWidest))
      fail(key, "is not an image size; two positive numbers are expected");
    return {static_cast<int>(v[0]), static_cast<int>(v[1])};
  }

  /// Camera of a rectified projection P = K [I | t], without its image size, and its position: X_k
  /// = X_rectified + *t.
  [[nodiscard]] Intrinsics projection(const std::string& key, Vec3* t) const {
    const auto P = numbers<12>(key);
    if (P[1] != 0 || P[4] != 0 || P[8] != 0 || P[9] != 0 || P[10] != 1 || !(P[0] > 0 && P[5] > 0))
      fail(key,
           "is not the projection of a rectified camera: [fx 0 cx .; 0 fy cy .; 0 0 1 .] with "
           "positive focal lengths is expected");
    Intrinsics k;
    k.fx = P[0], k.fy = P[5], k.cx = P[2], k.cy = P[6];
    *t = {(P[3] - k.cx * P[11]) / k.fx, (P[7] - k.cy * P[11]) / k.fy, P[11]};
    return k;
  }

 private:
  struct Line {
    std::string_view rest;
    std::size_t number = 0;
  };
  std::filesystem::path file_;
  std::string text_;
  std::map<std::string_view, Line, std::less<>> found_;
};

std::string key(const char* name, int camera) { return fmt::format("{}_{:02d}", name, camera); }

/// Intrinsics of a camera and its transform from camera 00 before rectification.
Intrinsics read_camera(const Text& text, int number, bool rectified, Transform* T_camera_camera0) {
  Intrinsics lens;
  if (rectified) {
    // All cameras were rotated into the axes of the rectified camera 00.
    T_camera_camera0->R = text.rotation(key("R_rect", 0));
    lens = text.projection(key("P_rect", number), &T_camera_camera0->t);
  } else {
    const auto K = text.numbers<9>(key("K", number));
    // The order is k1 k2 p1 p2 k3.
    lens.distortion = text.numbers<5>(key("D", number));
    lens.fx = K[0], lens.fy = K[4], lens.cx = K[2], lens.cy = K[5];
    if (!(lens.fx > 0 && lens.fy > 0) || K[1] != 0 || K[3] != 0 || K[8] != 1)
      text.fail(key("K", number), "is not [fx 0 cx; 0 fy cy; 0 0 1] with positive focal lengths");
    *T_camera_camera0 = text.rigid(key("R", number), key("T", number));
  }
  const ImageSize size = text.size(key(rectified ? "S_rect" : "S", number));
  lens.width = size.width, lens.height = size.height;
  return lens;
}

}  // namespace

bool accept_rotation(const Mat3& written) noexcept {
  // Lies between the rounding of seven digits (1.5e-7 in KITTI's poses) and a matrix that is no
  // rotation (1e-3 bends a kilometre by a metre).
  constexpr double kOrthonormality = 1e-4;
  const double error = (written * written.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff();
  return error <= kOrthonormality && written.determinant() > 0;
}

RigCalibration read_kitti_projections(const std::filesystem::path& file,
                                      const std::array<int, 2>& cameras,
                                      const std::optional<ImageSize>& size) {
  const Text text(file, ", or pass a calibration with --calibration");
  RigCalibration rig{.cameras = 2};
  std::array<Vec3, 2> t;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string raw = key("P_rect", cameras[k]), own = key("S_rect", cameras[k]);
    const std::string name = fmt::format("P{}", cameras[k]);
    rig.intrinsics[k] = text.projection(!text.has(name) && text.has(raw) ? raw : name, &t[k]);
    if (!size && !text.has(own))
      throw InputError(file.string() + ": holds no image size; add --size WIDTHxHEIGHT");
    const ImageSize images = size ? *size : text.size(own);
    rig.intrinsics[k].width = images.width, rig.intrinsics[k].height = images.height;
  }
  rig.T_camera_left[1].t = t[1] - t[0];
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

KittiRawRig read_kitti_raw_rig(const KittiRawFolders& folders, const std::array<int, 2>& cameras,
                               ImageSize images) {
  const std::filesystem::path file = folders.calibration / kKittiRawCalibration;
  const Text text(file, ", or pass one with --calibration");
  const ImageSize raw = text.size(key("S", cameras[0])),
                  rectified = text.size(key("S_rect", cameras[0]));
  if (images != raw && images != rectified)
    text.fail(key("S", cameras[0]),
              fmt::format("is for images of {}x{} pixels, or {}x{} rectified, but the images have "
                          "{}x{}; use the calibration of their date",
                          raw.width, raw.height, rectified.width, rectified.height, images.width,
                          images.height));
  const bool are_rectified =
      images == rectified &&
      (images != raw || folders.drive.filename().string().ends_with("_sync"));
  KittiRawRig out;
  std::array<Transform, 2> T_camera_camera0;
  out.rig.cameras = 2;
  for (std::size_t k = 0; k < 2; ++k)
    out.rig.intrinsics[k] = read_camera(text, cameras[k], are_rectified, &T_camera_camera0[k]);
  out.T_left_camera0 = T_camera_camera0[0];
  out.rig.T_camera_left[1] = T_camera_camera0[1] * T_camera_camera0[0].inverse();
  if (are_rectified)
    // This avoids the rounding of the product.
    out.rig.T_camera_left[1].R = Mat3::Identity();
  out.rig.baseline = out.rig.T_camera_left[1].t.norm();
  if (const auto bad = find_implausible(&out.rig)) refuse(file, 0, bad->message);
  return out;
}

Transform read_kitti_raw_mount(const KittiRawFolders& folders) {
  const auto rigid = [&](const char* name) {
    return Text(folders.calibration / name,
                ", or set the left camera's position in the INS body: `--set ins.lever_arm_m=[…]`")
        .rigid("R", "T");
  };
  return rigid("calib_velo_to_cam.txt") * rigid("calib_imu_to_velo.txt");
}

}  // namespace vergence::app
