#include "tests/rigs/film.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/support/rendered_drive.hpp"

namespace vergence::test {
namespace {

constexpr std::size_t kImageBytes = static_cast<std::size_t>(kFilmWidth) * kFilmHeight;

std::filesystem::path image_file(const std::filesystem::path& folder, std::size_t camera) {
  return folder / ("camera" + std::to_string(camera) + ".raw");
}

constexpr int kPairs = 100;
/// Frame rate, and speed in m/s on the straights.
constexpr double kRateHz = 10, kSpeed = 6;
/// Time in s into the drive, which stands for its first three seconds.
constexpr double kStart = 2;

/// Description of the film, in a file that is written last.
std::string key() {
  std::ostringstream key;
  key << "film 2: " << kPairs << " " << kRateHz << " " << kSpeed << " " << kStart;
  return key.str();
}

bool there_already(const std::filesystem::path& folder) {
  std::ifstream file(folder / "film.txt");
  std::string line;
  return file && std::getline(file, line) && line == key();
}

}  // namespace

void render_film(const std::filesystem::path& folder) {
  if (there_already(folder)) return;
  std::filesystem::create_directories(folder);
  RenderedDrive drive({.rig = nominal_rig(),
                       .drive = {.kind = mock::DriveKind::brief, .speed = kSpeed},
                       .from_s = kStart,
                       .rate = kRateHz});
  std::ofstream poses(folder / "truth.txt");
  poses << std::setprecision(17);
  std::array<std::ofstream, 2> images;
  for (std::size_t k = 0; k < 2; ++k) images[k].open(image_file(folder, k), std::ios::binary);
  const Transform T_first_enu = drive.T_enu_left(0).inverse();
  for (std::uint64_t n = 0; n < kPairs; ++n) {
    const Transform T = T_first_enu * drive.T_enu_left(n);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) poses << T.R(i, j) << " ";
    poses << T.t.x() << " " << T.t.y() << " " << T.t.z() << "\n";
    const RigFrame& frame = drive.frame(n);
    for (std::size_t k = 0; k < 2; ++k)
      for (int y = 0; y < kFilmHeight; ++y)
        images[k].write(reinterpret_cast<const char*>(frame.images[k].row(y)), kFilmWidth);
  }
  for (std::size_t k = 0; k < 2; ++k)
    if (!images[k].flush())
      throw std::runtime_error(image_file(folder, k).string() + ": cannot be written");
  std::ofstream done(folder / "film.txt");
  done << key() << "\n";
  if (!poses.flush() || !done.flush())
    throw std::runtime_error(folder.string() + ": cannot be written");
}

Film::Film(const std::filesystem::path& folder) {
  for (std::size_t k = 0; k < 2; ++k) {
    std::ifstream in(image_file(folder, k), std::ios::binary);
    images_[k].assign(std::istreambuf_iterator<char>(in), {});
  }
  std::ifstream in(folder / "truth.txt");
  for (Transform T; in;) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) in >> T.R(i, j);
    in >> T.t.x() >> T.t.y() >> T.t.z();
    if (in) truth_.push_back(T);
  }
  if (truth_.empty() || images_[0].size() != truth_.size() * kImageBytes ||
      images_[1].size() != images_[0].size())
    throw std::runtime_error(folder.string() + ": no film, or not all of it");
}

std::span<const std::uint8_t> Film::image(std::size_t camera, std::uint64_t number) const {
  const std::size_t n = std::min<std::size_t>(number, pairs() - 1);
  return std::span(images_[camera]).subspan(n * kImageBytes, kImageBytes);
}

}  // namespace vergence::test
