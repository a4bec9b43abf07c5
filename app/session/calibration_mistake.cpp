#include "app/session/calibration_mistake.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/camera/camera.hpp"
#include "core/geometry/epipolar.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kFewest = 200;  // matches
constexpr double kShare =
    0.9;  // of the matches: the edges of the image show most, the few beyond are wrong matches
constexpr double kOff = 1.0;     // px: published calibrations leave less
constexpr double kBetter = 2.0;  // times

/// What nine of ten matches are nearer than to their epipolar lines, px; endless: too few.
double distance(std::span<const RawMatch> matches, const RigCalibration& rig,
                std::uint64_t before) {
  const Camera left(rig.intrinsics[0]), right(rig.intrinsics[1]);
  const EpipolarGeometry geometry(rig.T_camera_left[1]);
  std::vector<double> off;
  for (const RawMatch& m : matches) {
    Vec3 a, b;
    double d = 0;
    if (m.camera != 1 || m.frame >= before || !left.unproject(Vec2(m.left[0], m.left[1]), &a) ||
        !right.unproject(Vec2(m.other[0], m.other[1]), &b) ||
        geometry.to_line(a.head<2>() / a.z(), b.head<2>() / b.z(), &d, nullptr) !=
            EpipolarStatus::ok)
      continue;
    off.push_back(std::abs(d) * rig.intrinsics[1].fx);
  }
  if (off.size() < kFewest) return std::numeric_limits<double>::infinity();
  const auto at =
      off.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(off.size()));
  std::nth_element(off.begin(), at, off.end());
  return *at;
}

bool has_distortion(const RigCalibration& rig) {
  const auto& d = rig.intrinsics[0].distortion;
  return std::any_of(d.begin(), d.end(), [](double v) { return v != 0; });
}

}  // namespace

std::string_view to_string(CalibrationMistake mistake) noexcept {
  switch (mistake) {
    case CalibrationMistake::none:
      return "";
    case CalibrationMistake::rotation_transposed:
      return "rotation_transposed";
    case CalibrationMistake::already_rectified:
      return "already_rectified";
  }
  return "";
}

CalibrationMistake find_mistake(std::span<const RawMatch> matches, const RigCalibration& rig,
                                std::uint64_t before) {
  const double given = distance(matches, rig, before);
  if (!(given > kOff) || !std::isfinite(given)) return CalibrationMistake::none;
  RigCalibration mended = rig;
  mended.T_camera_left[1].R.transposeInPlace();
  if (kBetter * distance(matches, mended, before) < given)
    return CalibrationMistake::rotation_transposed;
  if (!has_distortion(rig) || rig.intrinsics[0].kind != CameraModelKind::pinhole_radtan)
    return CalibrationMistake::none;
  mended = rig;
  for (Intrinsics& lens : mended.intrinsics) lens.distortion.fill(0);
  return kBetter * distance(matches, mended, before) < given ? CalibrationMistake::already_rectified
                                                             : CalibrationMistake::none;
}

}  // namespace vergence::app
