#include "app/datasets/image_writer.hpp"

#include <png.h>

#include "app/runtime/errors.hpp"

namespace vergence::app {

void write_png(const std::filesystem::path& file, const ImageView& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_GRAY;
  png.flags = PNG_IMAGE_FLAG_FAST;
  if (::png_image_write_to_file(&png, file.c_str(), 0, image.row(0), static_cast<int>(image.stride),
                                nullptr) == 0)
    throw InputError(file.string() +
                     ": cannot be written; check the free space and the permissions");
}

}  // namespace vergence::app
