#include <algorithm>
#include <array>
#include <unordered_map>

#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/euroc_sensor.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

struct Entry {
  Stamp stamp{};
  std::string file;  // relative to the root
};

std::vector<Entry> read_index(const std::filesystem::path& root, const std::string& camera) {
  const std::filesystem::path file = root / camera / "data.csv";
  const std::string text = read_text(file);
  Lines lines(text);
  std::vector<Entry> entries;
  for (std::string_view line; lines.next(&line);) {
    std::array<std::string_view, 2> fields;
    if (split(line, ',', fields) < 2 || fields[1].empty())
      refuse(file, lines.number(), "is not `stamp in nanoseconds,file name`");
    const auto ns = parse_integer(fields[0]);
    if (!ns)
      refuse(file, lines.number(),
             "`" + std::string(fields[0].substr(0, 40)) + "` is not a stamp in whole nanoseconds");
    if (fields[1].find('/') != std::string_view::npos)
      refuse(file, lines.number(), "names an image outside the folder data");
    entries.push_back({Stamp(*ns), camera + "/data/" + std::string(fields[1])});
  }
  if (entries.empty()) refuse(file, 0, "lists no images");
  return entries;
}

/// The right image of the same stamp for each left one; right ones alone stand where their stamp
/// belongs.
std::vector<StereoPair> pair_by_stamp(const std::vector<Entry>& left,
                                      const std::vector<Entry>& right) {
  std::unordered_map<std::int64_t, std::size_t> of_left;
  for (std::size_t i = 0; i < left.size(); ++i) of_left.emplace(left[i].stamp.ns(), i);
  std::unordered_map<std::int64_t, const Entry*> of_right;
  std::vector<const Entry*> alone;
  for (const Entry& e : right) {
    of_right.emplace(e.stamp.ns(), &e);
    if (!of_left.contains(e.stamp.ns())) alone.push_back(&e);
  }
  std::stable_sort(alone.begin(), alone.end(),
                   [](const Entry* a, const Entry* b) { return a->stamp < b->stamp; });
  std::vector<StereoPair> pairs;
  auto next_alone = alone.begin();
  for (const Entry& e : left) {
    for (; next_alone != alone.end() && (*next_alone)->stamp < e.stamp; ++next_alone)
      pairs.push_back({(*next_alone)->stamp, {"", (*next_alone)->file}});
    const auto match = of_right.find(e.stamp.ns());
    pairs.push_back({e.stamp, {e.file, match == of_right.end() ? "" : match->second->file}});
  }
  for (; next_alone != alone.end(); ++next_alone)
    pairs.push_back({(*next_alone)->stamp, {"", (*next_alone)->file}});
  return pairs;
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
  sequence.pairs =
      pair_by_stamp(read_index(sequence.root, "cam0"), read_index(sequence.root, "cam1"));
  if (std::none_of(sequence.pairs.begin(), sequence.pairs.end(),
                   [](const StereoPair& p) { return !p.file[0].empty() && !p.file[1].empty(); }))
    refuse(sequence.root / "cam1" / "data.csv", 0,
           "has no stamp in common with that of cam0; the two do not belong together");
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
