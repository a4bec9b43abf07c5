#include "tests/rigs/film.hpp"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include "drivers/mock/rig_truth.hpp"
#include "drivers/mock/world/renderer.hpp"

namespace vergence::test {
namespace {

constexpr std::size_t kImageBytes = static_cast<std::size_t>(kFilmWidth) * kFilmHeight;

std::filesystem::path image_file(const std::filesystem::path& folder, std::size_t camera) {
  return folder / ("camera" + std::to_string(camera) + ".raw");
}

RigCalibration rig() {
  RigCalibration rig;
  rig.cameras = 2;
  rig.baseline = 0.75;
  for (std::size_t k = 0; k < 2; ++k) {
    Intrinsics& lens = rig.intrinsics[k];
    lens.width = kFilmWidth;
    lens.height = kFilmHeight;
    lens.fx = lens.fy = 0.72 * kFilmWidth;
    lens.cx = 0.5 * (kFilmWidth - 1);
    lens.cy = 0.5 * (kFilmHeight - 1);
    lens.distortion = {-0.08, 0.02, 0, 0, 0};
    rig.T_camera_left[k].t = {-0.75 * static_cast<double>(k), 0, 0};
  }
  return rig;
}

constexpr int kPairs = 100;
constexpr double kRateHz = 10, kSpeed = 6;  // m/s, on the straights
constexpr double kStart = 2;                // s of the drive, which stands for its first three

/// Description of the film, in a file that is written last.
std::string key() {
  std::ostringstream key;
  key << "film 1: " << kPairs << " " << kRateHz << " " << kSpeed << " " << kStart;
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
  mock::DriveOptions way;
  way.kind = mock::DriveKind::brief;
  way.speed = kSpeed;
  const mock::RigTruth truth(std::make_shared<const mock::World>(mock::WorldOptions{}), way, rig(),
                             mock::default_T_body_left(), {}, {});
  std::ofstream poses(folder / "truth.txt");
  poses << std::setprecision(17);
  const auto time = [&](int n) { return Duration::seconds(kStart + n / kRateHz); };
  const Transform T_first_enu = truth.camera_in_enu(0, time(0)).inverse();
  for (int n = 0; n < kPairs; ++n) {
    const Transform T = T_first_enu * truth.camera_in_enu(0, time(n));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) poses << T.R(i, j) << " ";
    poses << T.t.x() << " " << T.t.y() << " " << T.t.z() << "\n";
  }
  std::vector<std::uint8_t> image(kImageBytes);
  for (std::size_t k = 0; k < 2; ++k) {
    mock::Renderer renderer(truth.shared_world(), Camera(truth.mounted().intrinsics[k]));
    std::ofstream out(image_file(folder, k), std::ios::binary);
    for (int n = 0; n < kPairs; ++n) {
      mock::RenderRequest shot;
      shot.noise_seed = static_cast<std::uint32_t>(2 * n + 1) + static_cast<std::uint32_t>(k);
      renderer.render(truth.camera_in_enu(static_cast<int>(k), time(n)).inverse(), shot,
                      image.data(), kFilmWidth);
      out.write(reinterpret_cast<const char*>(image.data()),
                static_cast<std::streamsize>(image.size()));
    }
    if (!out.flush())
      throw std::runtime_error(image_file(folder, k).string() + ": cannot be written");
  }
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
