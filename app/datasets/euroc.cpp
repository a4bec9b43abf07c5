#include <algorithm>
#include <array>

#include "app/datasets/detail/formats.hpp"
#include "app/datasets/euroc_sensor.hpp"
#include "app/datasets/text_file.hpp"
#include "app/datasets/times_file.hpp"

namespace vergence::app::detail {
namespace {

/// The images of a camera, as its data.csv lists them.
struct Index {
  std::vector<Stamp> stamps{};
  std::vector<std::string> files{};  // relative to the root
};

Index read_index(const std::filesystem::path& root, const std::string& camera,
                 std::vector<std::string>* assumptions) {
  const std::filesystem::path file = root / camera / "data.csv";
  Index index;
  const TimesFile times = read_times_file(file, TimeUnit::nanoseconds);
  for (const TimesLine& line : times.lines) {
    index.stamps.push_back(line.stamp);
    index.files.push_back(
        camera + "/data/" +
        (line.name[0].empty() ? std::to_string(line.stamp.ns()) + ".png" : line.name[0]));
  }
  assumptions->insert(assumptions->end(), times.remarks.begin(), times.remarks.end());
  return index;
}

/// Lens and size of a camera's sensor.yaml.
Intrinsics read_intrinsics(const std::filesystem::path& file) {
  const YAML::Node root = read_sensor_yaml(file);
  const auto numbers = [&](const char* key, std::size_t least, std::size_t most) {
    const YAML::Node node = root[key];
    try {
      if (node && node.IsSequence() && node.size() >= least && node.size() <= most)
        return node.as<std::vector<double>>();
    } catch (const YAML::Exception&) {  // said below
    }
    refuse(file, node && node.Mark().line >= 0 ? static_cast<std::size_t>(node.Mark().line) + 1 : 0,
           std::string(key) + " is not a list of " + std::to_string(least) +
               (most > least ? " or more" : "") + " numbers");
  };
  const auto word = [&](const char* key) {
    const YAML::Node node = root[key];
    if (!node || !node.IsScalar()) refuse(file, 0, std::string("has no ") + key);
    return node.as<std::string>();
  };
  Intrinsics k;
  if (const auto model = word("camera_model"); model != "pinhole")
    refuse(file, 0, "camera_model is " + model + "; pinhole is what can be read");
  const auto distortion = word("distortion_model");
  if (distortion == "equidistant")
    k.kind = CameraModelKind::pinhole_equidistant;
  else if (distortion != "radial-tangential")
    refuse(file, 0,
           "distortion_model is " + distortion +
               "; radial-tangential and equidistant are what can be read");
  const auto size = numbers("resolution", 2, 2), f = numbers("intrinsics", 4, 4);
  const auto d =
      numbers("distortion_coefficients", 4, k.kind == CameraModelKind::pinhole_radtan ? 5 : 4);
  constexpr double kLargestSide = 1 << 15;  // px
  for (const double side : size)
    if (!(side >= 1 && side <= kLargestSide)) refuse(file, 0, "resolution is no size of an image");
  k.width = static_cast<int>(size[0]), k.height = static_cast<int>(size[1]);
  k.fx = f[0], k.fy = f[1], k.cx = f[2], k.cy = f[3];
  std::copy(d.begin(), d.end(), k.distortion.begin());
  return k;
}

}  // namespace

StereoSequence open_euroc(const std::filesystem::path& folder, bool given) {
  StereoSequence sequence;
  std::error_code ignored;
  sequence.root =
      std::filesystem::is_directory(folder / "mav0", ignored) ? folder / "mav0" : folder;
  sequence.times = sequence.root / "cam0" / "data.csv";
  for (const char* camera : {"cam0", "cam1"})
    require_folder(sequence.root / camera, "data.csv, sensor.yaml and data/ of that camera");
  const std::array cameras{read_index(sequence.root, "cam0", &sequence.assumptions),
                           read_index(sequence.root, "cam1", &sequence.assumptions)};
  sequence.pairs = merged_pairs(
      cameras[0].stamps, cameras[1].stamps,
      [&](std::size_t k, std::size_t i) { return cameras[k].files[i]; }, &sequence.assumptions);
  if (std::none_of(sequence.pairs.begin(), sequence.pairs.end(),
                   [](const StereoPair& p) { return !p.file[0].empty() && !p.file[1].empty(); }))
    refuse(sequence.root / "cam1" / "data.csv", 0,
           "has no stamp near one of cam0's; the two do not belong together");
  if (given) return sequence;
  const std::filesystem::path left = sequence.root / "cam0" / "sensor.yaml",
                              right = sequence.root / "cam1" / "sensor.yaml";
  RigCalibration& rig = sequence.calibration;
  rig.cameras = 2;
  rig.intrinsics = {read_intrinsics(left), read_intrinsics(right)};
  rig.T_camera_left[1] = read_sensor_mount(right).inverse() * read_sensor_mount(left);
  rig.T_camera_left[1].R = normalised(rig.T_camera_left[1].R);
  rig.baseline = rig.T_camera_left[1].t.norm();
  sequence.calibration_source = "cam1/sensor.yaml";
  return sequence;
}

}  // namespace vergence::app::detail
