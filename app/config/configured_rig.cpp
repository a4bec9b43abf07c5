#include "app/config/configured_rig.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

namespace vergence::app {
namespace {

const char* model_word(CameraModelKind model) {
  return model == CameraModelKind::pinhole_equidistant ? "pinhole-equidistant" : "pinhole-radtan";
}

/// Another release may reckon a rotation's last digit otherwise; nobody writes so many.
bool as_configured(double a, double b) { return std::abs(a - b) <= 1e-9 + 1e-6 * std::abs(b); }

template <class Numbers>
bool same_numbers(const Numbers& a, const Numbers& b) {
  return std::equal(a.begin(), a.end(), b.begin(), as_configured);
}

template <class Numbers>
std::string listed(const Numbers& numbers) {
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

YAML::Node need_key(const YamlFile& file, const YAML::Node& node, const std::string& name,
                    const char* key) {
  const YAML::Node below = node[key];
  if (!below) file.fail(node, name + "." + key + " is missing");
  return below;
}

ConfiguredCamera read_configured_camera(const YamlFile& file, const YAML::Node& node,
                                        const std::string& name) {
  file.check_keys(node, name, {"model", "offset", "intrinsics", "distortion", "T_camera_left"});
  const auto read = [&](const char* key, auto* numbers) {
    const auto given = file.numbers(need_key(file, node, name, key), name + "." + key,
                                    numbers->size(), numbers->size());
    std::copy(given.begin(), given.end(), numbers->begin());
  };
  ConfiguredCamera camera;
  const YAML::Node model = need_key(file, node, name, "model");
  const std::string word = file.text(model, name + ".model");
  if (word == model_word(CameraModelKind::pinhole_equidistant))
    camera.model = CameraModelKind::pinhole_equidistant;
  else if (word != model_word(CameraModelKind::pinhole_radtan))
    file.fail(model, name + ".model is neither pinhole-radtan nor pinhole-equidistant");
  read("offset", &camera.offset);
  read("intrinsics", &camera.intrinsics);
  read("distortion", &camera.distortion);
  read("T_camera_left", &camera.T_camera_left);
  return camera;
}

std::string find_change(const ConfiguredCamera& then, const ConfiguredCamera& now, std::size_t k) {
  constexpr const char* kSentence =
      "when it was found the configuration had the {} {} for camera {}, it has {} now";
  if (then.model != now.model)
    return fmt::format(kSentence, "model", model_word(then.model), k, model_word(now.model));
  if (!same_numbers(then.offset, now.offset))
    return fmt::format(kSentence, "offset", listed(then.offset), k, listed(now.offset));
  if (!same_numbers(then.intrinsics, now.intrinsics))
    return fmt::format(kSentence, "intrinsics", listed(then.intrinsics), k, listed(now.intrinsics));
  if (!same_numbers(then.distortion, now.distortion))
    return fmt::format(kSentence, "distortion", listed(then.distortion), k, listed(now.distortion));
  if (!same_numbers(then.T_camera_left, now.T_camera_left))
    return fmt::format("when it was found the configuration had another place for camera {}", k);
  return "";
}

}  // namespace

ConfiguredCamera ConfiguredCamera::of(const Intrinsics& lens, const Transform& place) {
  ConfiguredCamera camera;
  camera.model = lens.kind;
  camera.intrinsics = {lens.fx, lens.fy, lens.cx, lens.cy};
  camera.distortion = lens.distortion;
  auto next = camera.T_camera_left.begin();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) *next++ = place.R(row, column);
    *next++ = place.t(row);
  }
  return camera;
}

std::string format_configured(const ConfiguredRig& rig) {
  std::string text = fmt::format(
      "configured:  # the configuration it was found under\n  baseline: {}\n  cameras:\n",
      rig.baseline);
  for (const ConfiguredCamera& c : rig.cameras)
    text += fmt::format(
        "    - {{model: {}, offset: {}, intrinsics: {}, distortion: {}, T_camera_left: {}}}\n",
        model_word(c.model), listed(c.offset), listed(c.intrinsics), listed(c.distortion),
        listed(c.T_camera_left));
  return text;
}

ConfiguredRig read_configured(const YamlFile& file, const YAML::Node& node) {
  file.check_keys(node, "configured", {"baseline", "cameras"});
  ConfiguredRig rig;
  rig.baseline = file.number(need_key(file, node, "configured", "baseline"), "configured.baseline");
  const YAML::Node cameras = need_key(file, node, "configured", "cameras");
  if (!cameras.IsSequence()) file.fail(node, "configured.cameras is not a list");
  for (std::size_t k = 0; k < cameras.size(); ++k)
    rig.cameras.push_back(
        read_configured_camera(file, cameras[k], fmt::format("configured.cameras.{}", k)));
  return rig;
}

std::string find_change(const ConfiguredRig& then, const ConfiguredRig& now) {
  if (then.cameras.size() != now.cameras.size())
    return fmt::format("when it was found the configuration had {} cameras, it has {} now",
                       then.cameras.size(), now.cameras.size());
  if (!as_configured(then.baseline, now.baseline))
    return fmt::format("it was found with a baseline of {} m, the configuration says {} m",
                       then.baseline, now.baseline);
  for (std::size_t k = 0; k < then.cameras.size(); ++k)
    if (std::string change = find_change(then.cameras[k], now.cameras[k], k); !change.empty())
      return change;
  return "";
}

}  // namespace vergence::app
