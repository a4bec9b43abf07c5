#include "app/snap/picture_files.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "app/runtime/errors.hpp"

namespace vergence::app {

std::vector<std::string> camera_names(const Configuration& c, int cameras) {
  std::vector<std::string> names;
  for (int k = 0; k < cameras; ++k) {
    std::string name = c.cameras[static_cast<std::size_t>(k)].name;
    std::replace_if(
        name.begin(), name.end(), [](unsigned char ch) { return std::isalnum(ch) == 0 && ch != '_' && ch != '-'; }, '_');
    if (name.empty()) name = "camera" + std::to_string(k);
    while (std::find(names.begin(), names.end(), name) != names.end()) name += "_" + std::to_string(k);
    names.push_back(std::move(name));
  }
  return names;
}

void write_png(const std::filesystem::path& file, const ImageView& image) {
  // imencode() only reads; cv::Mat has no const form.
  const cv::Mat pixels(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data), static_cast<std::size_t>(image.stride));
  std::vector<std::uint8_t> png;
  constexpr int kQuick = 1;  // compression: images come several times a second
  if (!cv::imencode(".png", pixels, png, {cv::IMWRITE_PNG_COMPRESSION, kQuick}))
    throw InputError(file.string() + ": this image cannot be made a PNG");
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  out.close();
  if (!out) throw InputError(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace vergence::app
