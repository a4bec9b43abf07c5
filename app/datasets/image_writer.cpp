#include "app/datasets/image_writer.hpp"

#include <jpeglib.h>
#include <png.h>

#include <csetjmp>
#include <cstdlib>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

struct Failure {
  jpeg_error_mgr manager;
  std::jmp_buf back;
};

[[noreturn]] void jump_back(j_common_ptr info) {
  std::longjmp(reinterpret_cast<Failure*>(info->err)->back, 1);
}
void ignore(j_common_ptr /*info*/) {}

/// No object with a destructor may be created between setjmp and libjpeg's longjmp, so all of them
/// are the caller's.
bool compress(const ImageView& image, int quality, Failure* failure, jpeg_compress_struct* jpeg,
              unsigned char** out, unsigned long* size) noexcept {
  jpeg->err = jpeg_std_error(&failure->manager);
  failure->manager.error_exit = jump_back;
  failure->manager.output_message = ignore;
  if (setjmp(failure->back) != 0) {
    jpeg_destroy_compress(jpeg);
    return false;
  }
  jpeg_create_compress(jpeg);
  jpeg_mem_dest(jpeg, out, size);
  jpeg->image_width = static_cast<JDIMENSION>(image.width);
  jpeg->image_height = static_cast<JDIMENSION>(image.height);
  jpeg->input_components = 1;
  jpeg->in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(jpeg);
  jpeg_set_quality(jpeg, quality, TRUE);
  jpeg->dct_method = JDCT_IFAST;
  jpeg_start_compress(jpeg, TRUE);
  while (jpeg->next_scanline < jpeg->image_height) {
    // The library does not write to its source, although the type permits it.
    auto* row = const_cast<JSAMPROW>(image.row(static_cast<int>(jpeg->next_scanline)));
    (void)jpeg_write_scanlines(jpeg, &row, 1);
  }
  jpeg_finish_compress(jpeg);
  jpeg_destroy_compress(jpeg);
  return true;
}

}  // namespace

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

std::string grey_jpeg(const ImageView& image, int quality) {
  if (image.empty()) return {};
  Failure failure{};
  jpeg_compress_struct jpeg{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool done = compress(image, quality, &failure, &jpeg, &bytes, &size);
  std::string out;
  if (done) out.assign(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  return out;
}

}  // namespace vergence::app
