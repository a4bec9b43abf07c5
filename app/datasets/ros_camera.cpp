#include "app/datasets/ros_camera.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/datasets/detail/names.hpp"

namespace vergence::app {
namespace {

// Relative difference of the focal lengths of the two projection matrices.
constexpr double kSameRectification = 1e-6;

struct Model {
  // Names in lower-case letters and digits.
  std::string_view words;
  CameraModelKind kind;
};
constexpr std::array kModels{
    Model{
        "| radtan | radialtangential | pinholeradtan | plumbbob | brown | brownconrady | opencv | "
        "rational | rationalpolynomial | standard | pinhole | perspective | none | rectified |  |",
        CameraModelKind::pinhole_radtan},
    Model{"| equidistant | equidist | equi | pinholeequidistant | pinholeequi | fisheye | "
          "opencvfisheye | kannalabrandt | kannalabrandt4 | kannalabrandt8 | kb4 |",
          CameraModelKind::pinhole_equidistant}};

/// Offset of a principal point from the middle, relative to the image.
double off_middle(double x, double y, const ImageSize& size) {
  return std::max(std::abs(x / size.width - 0.5), std::abs(y / size.height - 0.5));
}

/// Subtracts an offset from pixel coordinates and divides them by a binning.
struct ToImage {
  double x = 0, y = 0, binning_x = 1, binning_y = 1;
  void apply(RosCamera* c) const {
    Intrinsics& k = c->lens;
    k.fx /= binning_x, k.fy /= binning_y;
    k.cx = (k.cx - x) / binning_x, k.cy = (k.cy - y) / binning_y;
    c->P(0, 2) -= x * c->P(2, 2), c->P(1, 2) -= y * c->P(2, 2);
    c->P.row(0) /= binning_x, c->P.row(1) /= binning_y;
  }
};

}  // namespace

std::optional<CameraModelKind> lens_model(std::string_view word) {
  using detail::lower;
  std::string plain = "| ";
  for (const char c : lower(word))
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) plain.push_back(c);
  plain += " |";
  for (const Model& model : kModels)
    if (model.words.find(plain) != std::string_view::npos) return model.kind;
  return std::nullopt;
}

bool is_rectified(const RosCamera& c) {
  const Intrinsics& k = c.lens;
  const auto zero = [](double d) { return d == 0; };
  return std::ranges::all_of(k.distortion, zero) && c.P(0, 0) == k.fx && c.P(1, 1) == k.fy &&
         c.P(0, 2) == k.cx && c.P(1, 2) == k.cy;
}

std::string apply_crop(const RosCrop& crop, const std::optional<ImageSize>& image, RosCamera* c) {
  const double bx = std::max(1U, crop.binning_x), by = std::max(1U, crop.binning_y);
  Intrinsics& k = c->lens;
  const bool part = crop.width > 0 && crop.height > 0;
  if (!part && bx == 1 && by == 1) return "";
  const double width = part ? crop.width : k.width, height = part ? crop.height : k.height;
  const ImageSize binned{static_cast<int>(width / bx), static_cast<int>(height / by)};
  const ImageSize own{k.width, k.height};
  const ImageSize size = image && *image == own && *image != binned ? own : binned;
  if (size.width < 1 || size.height < 1) return "";
  const ToImage whole{part ? crop.x : 0.0, part ? crop.y : 0.0, bx, by};
  // REP 104 takes precedence over a slightly better fit.
  constexpr double kNear = 0.15;
  const ToImage* best = &whole;
  const std::array others{ToImage{}, ToImage{0, 0, bx, by}, ToImage{whole.x, whole.y, 1, 1}};
  const auto off = [&](const ToImage& to) {
    return off_middle((k.cx - to.x) / to.binning_x, (k.cy - to.y) / to.binning_y, size);
  };
  if (off(whole) > kNear)
    for (const ToImage& other : others)
      if (off(other) < off(*best)) best = &other;
  best->apply(c);
  k.width = size.width, k.height = size.height;
  return best == &whole ? ""
                        : "CameraInfo has binning or a region, but its principal point shows that "
                          "its numbers are of the image itself; they are used unchanged";
}

std::string set_ros_distortion(std::string_view model, std::span<const double> d,
                               Intrinsics* lens) {
  const auto kind = lens_model(model);
  if (!kind)
    return fmt::format(
        "has the unknown model \"{}\"; supported are plumb_bob (radtan), equidistant (fisheye) and "
        "rational_polynomial",
        model.substr(0, 60));
  const bool equidistant = *kind == CameraModelKind::pinhole_equidistant;
  // Drivers with a fixed number of coefficients pad with zeros.
  const std::size_t given = d.size();
  while (equidistant && d.size() > 4 && d.back() == 0) d = d.first(d.size() - 1);
  if (equidistant ? d.size() != 4 && !d.empty() : d.size() > 14)
    return fmt::format("has {} numbers; equidistant (fisheye) has 4, other models up to 14", given);
  const auto used = d.first(std::min<std::size_t>(5, d.size()));
  const auto zero = [](double v) { return v == 0; };
  if (const auto rest = d.subspan(used.size()); !std::ranges::all_of(rest, zero))
    return "has k4 to k6 of a rational polynomial, which are not supported; calibrate as plumb_bob";
  lens->kind = equidistant ? CameraModelKind::pinhole_equidistant : CameraModelKind::pinhole_radtan;
  std::ranges::copy(used, lens->distortion.begin());
  return "";
}

std::string set_ros_rig(const RosCamera& left, const RosCamera& right, RigCalibration* rig) {
  const Mat34 &P_l = left.P, &P_r = right.P;
  const auto differ = [&](int i) {
    return !(std::abs(P_l(i, i) - P_r(i, i)) <= kSameRectification * P_l(i, i));
  };
  if (differ(0) || differ(1))
    return fmt::format(
        "has the focal length {}, but that of the left camera is {}, so they are not of one stereo "
        "calibration",
        P_r(0, 0), P_l(0, 0));
  if (P_l(0, 3) == P_r(0, 3) && P_l(1, 3) == P_r(1, 3) && (P_l(0, 3) != 0 || P_l(1, 3) != 0))
    return fmt::format(
        "has the fourth number {} in its first row, like that of the left camera, where a stereo "
        "calibration has 0: both cameras have the same P",
        P_r(0, 3));
  const Vec3 apart((P_r(0, 3) - P_l(0, 3)) / P_r(0, 0), (P_r(1, 3) - P_l(1, 3)) / P_r(1, 1), 0);
  if (!(apart.norm() > 0))
    return "has no baseline: the fourth number of its first row is −fx·B in a stereo calibration";
  if (apart.x() > 0.5 * apart.norm())
    return fmt::format(
        "has the fourth number {} in its first row, where a right camera has −fx·B: left and right "
        "are swapped, or its driver writes the other sign",
        P_r(0, 3));
  rig->cameras = 2;
  rig->intrinsics[0] = left.lens;
  rig->intrinsics[1] = right.lens;
  Transform& T = rig->T_camera_left[1];
  T.R = right.R.transpose() * left.R;
  T.t = right.R.transpose() * apart;
  rig->baseline = T.t.norm();
  return "";
}

}  // namespace vergence::app
