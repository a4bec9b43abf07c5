#include "app/datasets/image_writer.hpp"

#include <png.h>

#include <csetjmp>
#include <cstdio>

#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

[[noreturn]] void fail(png_structp png, png_const_charp /*what*/) { png_longjmp(png, 1); }
void ignore(png_structp /*png*/, png_const_charp /*what*/) noexcept {}

struct Writer {
  png_structp png = nullptr;
  png_infop info = nullptr;

  Writer() noexcept : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, ignore)) {
    if (png != nullptr) info = png_create_info_struct(png);
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
};

/// Between setjmp and libpng's longjmp nothing may stand that has a destructor: all of it is the
/// caller's.
bool write_rows(const Writer& writer, std::FILE* file, const ImageView& image) noexcept {
  constexpr int kQuick = 1;  // compression, of 9
  png_structp png = writer.png;
  png_infop info = writer.info;
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) return false;
  png_init_io(png, file);
  png_set_compression_level(png, kQuick);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  for (int y = 0; y < image.height; ++y) png_write_row(png, image.row(y));
  png_write_end(png, nullptr);
  return true;
}

}  // namespace

void write_png(const std::filesystem::path& file, const ImageView& image) {
  std::FILE* out = std::fopen(file.c_str(), "wbe");
  const bool written = out != nullptr && write_rows(Writer(), out, image);
  const bool closed = out != nullptr && std::fclose(out) == 0;
  if (!written || !closed)
    throw InputError(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace vergence::app
