#include "app/devices/camera_masks.hpp"

#include <algorithm>
#include <system_error>

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

/// PNG or PGM: a JPEG's zeros are not zero, because its compression leaves ripples about every
/// edge.
ImageFileStatus read_pixels(Bytes b, ImageSize requested, ImageSize* size,
                            std::uint8_t* out) noexcept {
  if (b.empty() || (b[0] != 0x89 && b[0] != 'P')) return ImageFileStatus::not_an_image;
  if (const auto status = read_image_size(b, size); status != ImageFileStatus::ok) return status;
  return decode_grey(b, requested, out, static_cast<std::size_t>(requested.width));
}

std::vector<std::uint8_t> read_mask(const std::string& key, const std::filesystem::path& file,
                                    ImageSize requested) {
  const auto fail = [&](const std::string& what) {
    throw InputError("{}: {} {}", key, file.string(), what);
  };
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(requested.width) *
                                   static_cast<std::size_t>(requested.height));
  ImageSize size;
  ImageFileStatus status = read_image_file(file, &bytes);
  if (status == ImageFileStatus::ok) status = read_pixels(bytes, requested, &size, pixels.data());
  if (status == ImageFileStatus::not_an_image)
    fail("is not a mask; use a PNG or binary PGM with 0 for pixels that are not used");
  if (status == ImageFileStatus::wrong_size)
    fail(
        fmt::format("is {} × {} px, but the camera's images are {} × {} px; paint it on one of "
                    "these images (vergence snap)",
                    size.width, size.height, requested.width, requested.height));
  if (status != ImageFileStatus::ok) fail(to_phrase(status));
  if (std::ranges::all_of(pixels, [](std::uint8_t v) { return v == 0; }))
    fail("is 0 everywhere, so no pixel is used; paint 0 only where the image must not be used");
  return pixels;
}

}  // namespace

CameraMasks::CameraMasks(const Configuration& c, const RigCalibration& rig) {
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    if (c.cameras[k].mask.empty()) continue;
    const std::string key = fmt::format("cameras.{}.mask", k);
    if (static_cast<int>(k) >= rig.cameras)
      throw InputError("{}: the rig has {} cameras, numbered from 0; remove this mask", key,
                       rig.cameras);
    const Intrinsics& lens = rig.intrinsics[k];
    pixels_[k] =
        read_mask(key, find_beside(c.folder, c.cameras[k].mask), {lens.width, lens.height});
    views_[k] = {pixels_[k].data(), lens.width, lens.height, lens.width};
  }
}

}  // namespace vergence::app
