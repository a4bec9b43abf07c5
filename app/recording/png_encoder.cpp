#include "app/recording/png_encoder.hpp"

#include <png.h>

#include <csetjmp>
#include <exception>

namespace vergence::app {
namespace {

[[noreturn]] void fail(png_structp png, png_const_charp /*what*/) { png_longjmp(png, 1); }
void ignore(png_structp /*png*/, png_const_charp /*what*/) noexcept {}
void flush(png_structp /*png*/) noexcept {}

struct Output {
  std::vector<std::uint8_t>* file;
  bool out_of_memory = false;
};

void append(png_structp png, png_bytep bytes, std::size_t size) {
  auto* output = static_cast<Output*>(png_get_io_ptr(png));
  try {
    output->file->insert(output->file->end(), bytes, bytes + size);
  } catch (const std::bad_alloc&) {  // an exception must not cross libpng's C frames
    output->out_of_memory = true;
  }
  if (output->out_of_memory) png_error(png, "no memory");
}

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

/// No object with a destructor may live between setjmp and libpng's longjmp, so the caller owns
/// them all.
bool write_rows(const Writer& writer, Output* output, const ImageView& image) noexcept {
  constexpr int kQuick = 1;  // compression, of 9
  png_structp png = writer.png;
  png_infop info = writer.info;
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, output, append, flush);
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

bool encode_png(const ImageView& image, std::vector<std::uint8_t>* file) {
  file->clear();
  if (image.empty()) return false;
  Output output{file};
  const bool written = write_rows(Writer(), &output, image);
  if (output.out_of_memory) throw std::bad_alloc();
  return written;
}

}  // namespace vergence::app
