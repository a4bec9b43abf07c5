#include "app/datasets/detail/image_kinds.hpp"

#include <png.h>

#include <csetjmp>
#include <cstring>

namespace vergence::app::detail {
namespace {

// Size of the signature and the whole IHDR chunk, in bytes.
constexpr std::size_t kPngHead = 33;
constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

struct Source {
  ImageBytes bytes;
  std::size_t at = 0;
};

void read_on(png_structp png, png_bytep to, std::size_t n) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (n > source->bytes.size() - source->at) png_error(png, "ends");
  std::memcpy(to, &source->bytes[source->at], n);
  source->at += n;
}

[[noreturn]] void fail(png_structp png, png_const_charp /*what*/) { png_longjmp(png, 1); }
void ignore(png_structp /*png*/, png_const_charp /*what*/) noexcept {}

/// The two structures of libpng, which are released together.
struct Reader {
  png_structp png = nullptr;
  png_infop info = nullptr;

  Reader() noexcept : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, ignore)) {
    if (png != nullptr) info = png_create_info_struct(png);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
};

/// Converts a row of big-endian 16-bit grey to 8 bits in place.
void narrow_row(png_structp png, png_row_infop row, png_bytep data) {
  if (row->bit_depth != 16) return;
  const int bits = *static_cast<const int*>(png_get_user_transform_ptr(png));
  for (std::size_t i = 0; i < row->width; ++i) {
    const auto sample = static_cast<std::uint16_t>(data[2 * i] << 8U | data[2 * i + 1]);
    data[i] = narrowed(sample, bits);
  }
}

/// Requests the conversion to 8-bit grey.
void ask_for_grey(png_structp png, png_infop info, int* deep_bits) {
  const int colours = png_get_color_type(png, info), depth = png_get_bit_depth(png, info);
  if (depth == 16 && (colours & PNG_COLOR_MASK_COLOR) != 0) {
    png_set_strip_16(png);
  } else if (depth == 16) {
    png_set_read_user_transform_fn(png, narrow_row);
    png_set_user_transform_info(png, deep_bits, 8, 1);
  }
  png_set_strip_alpha(png);
  if (colours == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if ((colours & PNG_COLOR_MASK_COLOR) != 0)
    png_set_rgb_to_gray(png, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
  else if (depth < 8)
    png_set_expand_gray_1_2_4_to_8(png);
}

/// No object with a destructor may be created between setjmp and libpng's longjmp, so all of them
/// are the caller's.
bool read_rows(const Reader& reader, Source* source, ImageSize size, std::uint8_t* out,
               std::size_t stride, int* deep_bits) noexcept {
  png_structp png = reader.png;
  png_infop info = reader.info;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, source, read_on);
  constexpr std::array<png_byte, 15> kTexts{'t', 'E', 'X', 't', 0,   'z', 'T', 'X',
                                            't', 0,   'i', 'T', 'X', 't', 0};
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, kTexts.data(), 3);
  png_read_info(png, info);
  ask_for_grey(png, info, deep_bits);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  const auto width = static_cast<std::uint32_t>(size.width),
             height = static_cast<std::uint32_t>(size.height);
  if (png_get_image_width(png, info) != width || png_get_image_height(png, info) != height ||
      png_get_rowbytes(png, info) != width)
    return false;
  for (int pass = 0; pass < passes; ++pass)
    for (std::uint32_t y = 0; y < height; ++y) png_read_row(png, out + y * stride, nullptr);
  // This also verifies the last checksums.
  png_read_end(png, nullptr);
  return true;
}

ImageFileStatus png_size(ImageBytes b, ImageSize* size) noexcept {
  if (b.size() < kPngHead || std::memcmp(&b[12], "IHDR", 4) != 0) return ImageFileStatus::truncated;
  const auto side = [&](std::size_t at) { return whole_at(b, at, 4, std::endian::big); };
  return accept_size(side(16), side(20), size);
}

ImageFileStatus decode_png(ImageBytes bytes, ImageSize size, std::uint8_t* out, std::size_t stride,
                           int deep_bits) noexcept {
  const Reader reader;
  // libpng had no memory.
  if (reader.info == nullptr) return ImageFileStatus::undecodable;
  Source source{bytes};
  return read_rows(reader, &source, size, out, stride, &deep_bits) ? ImageFileStatus::ok
                                                                   : ImageFileStatus::truncated;
}

}  // namespace

const ImageKind kPng{kPngHead, {kSignature, kSignature}, png_size, decode_png};

}  // namespace vergence::app::detail
