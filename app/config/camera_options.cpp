#include "app/config/camera_options.hpp"

#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "app/runtime/nearest.hpp"
#include "app/runtime/withdrawn.hpp"

namespace vergence::app {
namespace {

constexpr std::size_t kShown = 60;  // bytes of a text from outside in a sentence

std::string no_such_option(const std::string& name, const CameraSettings& camera) {
  std::vector<std::string> names;
  for (const OptionRow& row : option_rows(camera.options)) names.push_back(row.name);
  if (const std::string why = why_withdrawn(Withdrawn::Kind::camera_option, name); !why.empty())
    return fmt::format("there is no option \"{}\"{}", name, why);
  const std::string near = did_you_mean(name, names);
  return fmt::format("there is no option \"{}\"{} {} cameras have {}", name.substr(0, kShown),
                     near.empty() ? ";" : near, camera.driver, fmt::join(names, ", "));
}

}  // namespace

std::string set_camera_option(const std::string& name, const std::string& value,
                              CameraSettings* camera) {
  if (std::holds_alternative<std::monostate>(camera->options)) {
    const auto begin = default_options(camera->driver);
    if (!begin) return {};
    camera->options = *begin;
  }
  if (set_option(name, value, &camera->options)) return {};
  const OptionRow* row = find_option(camera->options, name);
  if (row == nullptr) return no_such_option(name, *camera);
  return fmt::format("{} is \"{}\"; it takes {}", name.substr(0, kShown), value.substr(0, kShown),
                     row->values);
}

std::string set_camera_options(const std::string& text, CameraSettings* camera) {
  camera->options = {};
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size())
      return fmt::format(
          "\"{}\" is no option; they are NAME=VALUE, as in packet_size=9000, or a "
          "group {{packet_size: 9000}}",
          word.substr(0, kShown));
    if (std::string why =
            set_camera_option(word.substr(0, equals), word.substr(equals + 1), camera);
        !why.empty())
      return why;
  }
  return {};
}

}  // namespace vergence::app
