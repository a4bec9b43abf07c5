#include <algorithm>
#include <array>
#include <cmath>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

std::vector<Stamp> read_times(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  Lines lines(text);
  std::vector<Stamp> times;
  for (std::string_view line; lines.next(&line);) {
    const auto ns = parse_seconds_ns(line);
    if (!ns)
      refuse(file, lines.number(),
             "`" + std::string(line.substr(0, 40)) + "` is not a time in seconds");
    times.emplace_back(*ns);
  }
  if (times.empty()) refuse(file, 0, "holds no times; one line a frame is expected");
  return times;
}

RigCalibration read_calibration_of(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  Lines lines(text);
  std::array<std::optional<Intrinsics>, 2> cameras;
  std::array<Vec3, 2> t;
  for (std::string_view line; lines.next(&line);) {
    const bool left = line.starts_with("P0:"), right = line.starts_with("P1:");
    if (!left && !right) continue;
    std::array<std::string_view, 12> fields;
    std::array<double, 12> P{};
    if (split(line.substr(3), ' ', fields) != fields.size())
      refuse(file, lines.number(), "does not have the 12 numbers of a projection matrix");
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (!parse_number(fields[i], &P[i]))
        refuse(file, lines.number(),
               "`" + std::string(fields[i].substr(0, 40)) + "` is not a finite number");
    const std::size_t k = left ? 0 : 1;
    cameras[k] = rectified_camera(P, &t[k], file, lines.number());
  }
  for (std::size_t k = 0; k < 2; ++k)
    if (!cameras[k])
      refuse(file, 0,
             std::string("has no line ") + (k == 0 ? "P0:" : "P1:") +
                 " with the projection of that camera");
  RigCalibration rig;
  rig.cameras = 2;
  rig.intrinsics = {*cameras[0], *cameras[1]};
  rig.T_camera_left[1].t = t[1] - t[0];
  rig.baseline = rig.T_camera_left[1].t.norm();
  return rig;
}

/// Frame of an image by its name, `000123.png`.
std::size_t index_of(const std::filesystem::path& root, const std::string& name,
                     std::size_t count) {
  const std::string stem = std::filesystem::path(name).stem().string();
  const auto index = parse_integer(stem);
  if (!index || *index < 0) refuse(root / name, 0, "is not named by its frame, like 000000.png");
  const auto i = static_cast<std::size_t>(*index);
  if (i >= count)
    refuse(root / name, 0,
           "has no line in times.txt, which ends with frame " + std::to_string(count - 1) +
               "; the two do not belong together");
  return i;
}

}  // namespace

Intrinsics rectified_camera(const std::array<double, 12>& P, Vec3* t,
                            const std::filesystem::path& file, std::size_t line) {
  Intrinsics k;
  k.fx = P[0], k.fy = P[5], k.cx = P[2], k.cy = P[6];
  if (!(k.fx > 0 && k.fy > 0)) refuse(file, line, "has a focal length that is not positive");
  if (P[1] != 0 || P[4] != 0 || P[8] != 0 || P[9] != 0 || P[10] != 1)
    refuse(
        file, line,
        "is not the projection of a rectified camera: [fx 0 cx .; 0 fy cy .; 0 0 1 .] is expected");
  const double z = P[11];
  *t = {(P[3] - k.cx * z) / k.fx, (P[7] - k.cy * z) / k.fy, z};
  return k;
}

StereoSequence open_kitti(const std::filesystem::path& folder, bool given) {
  StereoSequence sequence;
  sequence.root = folder;
  sequence.times = folder / "times.txt";
  const std::vector<Stamp> times = read_times(sequence.times);
  sequence.pairs.resize(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) sequence.pairs[i].stamp = times[i];
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string below = k == 0 ? "image_0" : "image_1";
    for (const std::string& name : list_images(folder, below))
      sequence.pairs[index_of(folder, name, times.size())].file[k] = name;
    for (std::size_t i = 0; i < times.size();
         ++i)  // a file that is missing still has a name to be missed by
      if (std::string& file = sequence.pairs[i].file[k]; file.empty()) {
        const std::string digits = std::to_string(i);
        file = below + "/" + std::string(6 - std::min<std::size_t>(6, digits.size()), '0') +
               digits + ".png";
      }
  }
  if (given) return sequence;
  sequence.calibration = read_calibration_of(folder / "calib.txt");
  sequence.calibration_source = "calib.txt";
  for (std::size_t k = 0; k < 2; ++k) {
    const ImageSize size = first_image_size(sequence, k);
    sequence.calibration.intrinsics[k].width = size.width;
    sequence.calibration.intrinsics[k].height = size.height;
  }
  return sequence;
}

}  // namespace vergence::app::detail
