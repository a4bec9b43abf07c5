#include "app/capture/picture_files.hpp"

#include <algorithm>
#include <cctype>

namespace vergence::app {

std::vector<std::string> camera_names(const Configuration& c, int cameras) {
  std::vector<std::string> names;
  for (int k = 0; k < cameras; ++k) {
    std::string name = c.cameras[static_cast<std::size_t>(k)].name;
    std::replace_if(
        name.begin(), name.end(),
        [](unsigned char ch) { return std::isalnum(ch) == 0 && ch != '_' && ch != '-'; }, '_');
    if (name.empty()) name = "camera" + std::to_string(k);
    while (std::find(names.begin(), names.end(), name) != names.end())
      name += "_" + std::to_string(k);
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace vergence::app
