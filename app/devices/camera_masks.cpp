#include "app/devices/camera_masks.hpp"

#include <algorithm>
#include <cctype>
#include <span>
#include <system_error>

#include <fmt/format.h>

#include "app/datasets/image_file.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::filesystem::path find_beside(const std::filesystem::path& folder, const std::string& name) {
  std::filesystem::path path(name);
  std::error_code none;
  if (path.is_absolute() || folder.empty() || !std::filesystem::exists(folder / path, none))
    return path;
  return folder / path;
}

/// The numbers of a binary PGM's head, and where its pixels begin.
struct PgmHead {
  int width = 0, height = 0, white = 0;
  std::size_t pixels = 0;
};

bool is_pgm(Bytes b) noexcept {
  return b.size() > 2 && b[0] == 'P' && b[1] == '5' && std::isspace(b[2]) != 0;
}

/// Width, height and white after "P5", apart by white space, in which `#` begins a remark. False:
/// not that.
bool read_pgm_head(Bytes b, PgmHead* head) noexcept {
  constexpr int kMax = 1 << 15;
  std::size_t at = 2;
  for (int* number : {&head->width, &head->height, &head->white}) {
    for (; at < b.size() && (std::isspace(b[at]) != 0 || b[at] == '#'); ++at)
      if (b[at] == '#')
        while (at + 1 < b.size() && b[at] != '\n') ++at;
    const std::size_t first = at;
    for (; at < b.size() && std::isdigit(b[at]) != 0 && *number <= kMax; ++at)
      *number = 10 * *number + (b[at] - '0');
    if (at == first || *number < 1 || *number > kMax) return false;
  }
  head->pixels = at + 1;
  return at < b.size() && std::isspace(b[at]) != 0;
}

ImageFileStatus read_pgm(Bytes b, ImageSize requested, ImageSize* size,
                         std::uint8_t* out) noexcept {
  PgmHead head;
  if (!read_pgm_head(b, &head) || head.white > 255) return ImageFileStatus::not_an_image;
  *size = {head.width, head.height};
  if (*size != requested) return ImageFileStatus::wrong_size;
  const auto n = static_cast<std::size_t>(head.width) * static_cast<std::size_t>(head.height);
  if (b.size() - head.pixels < n) return ImageFileStatus::truncated;
  std::copy_n(b.begin() + static_cast<std::ptrdiff_t>(head.pixels), n, out);
  return ImageFileStatus::ok;
}

ImageFileStatus read_png(Bytes b, ImageSize requested, ImageSize* size,
                         std::uint8_t* out) noexcept {
  constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
  // A JPEG's zeros are not zero: its compression leaves ripples about every edge.
  if (b.size() < kPng.size() || !std::equal(kPng.begin(), kPng.end(), b.begin()))
    return ImageFileStatus::not_an_image;
  const ImageFileStatus status = check_image(b, size);
  if (status != ImageFileStatus::ok) return status;
  return decode_grey(b, requested, out, static_cast<std::size_t>(requested.width));
}

std::vector<std::uint8_t> read_mask(const std::string& key, const std::filesystem::path& file,
                                    ImageSize requested) {
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}: {} {}", key, file.string(), what));
  };
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(requested.width) *
                                   static_cast<std::size_t>(requested.height));
  ImageSize size;
  ImageFileStatus status = read_image_file(file, &bytes);
  if (status == ImageFileStatus::ok)
    status = is_pgm(bytes) ? read_pgm(bytes, requested, &size, pixels.data())
                           : read_png(bytes, requested, &size, pixels.data());
  if (status == ImageFileStatus::not_an_image)
    fail("is no mask; a PNG or a binary PGM is, 0 where nothing is to be looked for");
  if (status == ImageFileStatus::wrong_size)
    fail(fmt::format("is {} × {} px, the camera's images are {} × {}; draw it on one of them",
                     size.width, size.height, requested.width, requested.height));
  if (status != ImageFileStatus::ok) fail(to_phrase(status));
  if (std::all_of(pixels.begin(), pixels.end(), [](std::uint8_t v) { return v == 0; }))
    fail("is 0 everywhere: nothing of the image is left; 0 hides, any other value shows");
  return pixels;
}

}  // namespace

CameraMasks::CameraMasks(const Configuration& c, const RigCalibration& rig) {
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    if (c.cameras[k].mask.empty()) continue;
    const std::string key = fmt::format("cameras.{}.mask", k);
    if (static_cast<int>(k) >= rig.cameras)
      throw InputError(fmt::format("{}: the rig has {} cameras, the first is 0", key, rig.cameras));
    Image& image = images_[k];
    image.width = rig.intrinsics[k].width;
    image.height = rig.intrinsics[k].height;
    image.pixels =
        read_mask(key, find_beside(c.folder, c.cameras[k].mask), {image.width, image.height});
  }
}

std::array<ImageView, kMaxCameras> CameraMasks::views() const noexcept {
  std::array<ImageView, kMaxCameras> views{};
  for (std::size_t k = 0; k < kMaxCameras; ++k)
    if (!images_[k].pixels.empty())
      views[k] = {images_[k].pixels.data(), images_[k].width, images_[k].height, images_[k].width};
  return views;
}

}  // namespace vergence::app
