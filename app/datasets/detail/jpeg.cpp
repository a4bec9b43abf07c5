#include "app/datasets/detail/image_kinds.hpp"

#include <csetjmp>
#include <cstdio>

#include <jpeglib.h>

#include <jerror.h>

namespace vergence::app::detail {
namespace {

// Progressive images have ten scans; each costs a pass over the whole image.
constexpr int kMaxScans = 100;

std::uint32_t u16(ImageBytes b, std::size_t at) noexcept {
  return whole_at(b, at, 2, std::endian::big);
}

// Frame headers are SOF0 to SOF15 without DHT, JPG and DAC.
bool is_frame_header(std::uint8_t marker) noexcept {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

/// State of libjpeg's error handler and progress monitor, and the point to which they jump.
struct Decoder {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf leave{};
  bool damaged = false;
};

Decoder* decoder_of(j_common_ptr jpeg) noexcept { return static_cast<Decoder*>(jpeg->client_data); }

[[noreturn]] void fail(j_common_ptr jpeg) { std::longjmp(decoder_of(jpeg)->leave, 1); }

/// After these warnings the decoder continues with grey or misplaced blocks.
bool is_damage(int code) noexcept {
  constexpr std::array kDamage{JWRN_HIT_MARKER,       JWRN_HUFF_BAD_CODE, JWRN_ARITH_BAD_CODE,
                               JWRN_JPEG_EOF,         JWRN_MUST_RESYNC,   JWRN_NOT_SEQUENTIAL,
                               JWRN_BOGUS_PROGRESSION};
  return std::ranges::find(kDamage, code) != kDamage.end();
}

void listen(j_common_ptr jpeg, int level) {
  if (level >= 0 || !is_damage(jpeg->err->msg_code)) return;
  decoder_of(jpeg)->damaged = true;
  fail(jpeg);
}

void count_scans(j_common_ptr jpeg) {
  if (decoder_of(jpeg)->jpeg.input_scan_number > kMaxScans) fail(jpeg);
}

/// No object with a destructor may be created between setjmp and the handlers' longjmp.
bool read_rows(Decoder* d, ImageBytes bytes, ImageSize size, std::uint8_t* out,
               std::size_t stride) noexcept {
  if (setjmp(d->leave) != 0) return false;
  jpeg_create_decompress(&d->jpeg);
  d->jpeg.client_data = d;
  d->jpeg.progress = &d->progress;
  jpeg_mem_src(&d->jpeg, bytes.data(), bytes.size());
  if (jpeg_read_header(&d->jpeg, TRUE) != JPEG_HEADER_OK) return false;
  const auto width = static_cast<JDIMENSION>(size.width),
             height = static_cast<JDIMENSION>(size.height);
  if (d->jpeg.image_width != width || d->jpeg.image_height != height) return false;
  d->jpeg.out_color_space = JCS_GRAYSCALE;
  (void)jpeg_start_decompress(&d->jpeg);
  if (d->jpeg.output_components != 1 || d->jpeg.output_width != width ||
      d->jpeg.output_height != height)
    return false;
  while (d->jpeg.output_scanline < height) {
    JSAMPROW row = out + d->jpeg.output_scanline * stride;
    (void)jpeg_read_scanlines(&d->jpeg, &row, 1);
  }
  return true;
}

ImageFileStatus jpeg_size(ImageBytes b, ImageSize* size) noexcept {
  std::size_t at = 2;
  while (at + 9 <= b.size()) {
    if (b[at] != 0xff) return ImageFileStatus::truncated;
    if (b[at + 1] == 0xff) {
      // This is a fill byte.
      ++at;
      continue;
    }
    if (is_frame_header(b[at + 1])) return accept_size(u16(b, at + 7), u16(b, at + 5), size);
    at += 2 + std::max<std::size_t>(2, u16(b, at + 2));
  }
  return ImageFileStatus::truncated;
}

bool has_end_marker(ImageBytes b) noexcept {
  std::size_t end = b.size();
  while (end > 2 && b[end - 1] == 0) --end;
  return b[end - 2] == 0xff && b[end - 1] == 0xd9;
}

ImageFileStatus decode_jpeg(ImageBytes bytes, ImageSize size, std::uint8_t* out, std::size_t stride,
                            int /*deep_bits*/) noexcept {
  if (!has_end_marker(bytes)) return ImageFileStatus::truncated;
  Decoder decoder;
  decoder.jpeg.err = jpeg_std_error(&decoder.errors);
  // jpeg_create_decompress() keeps this pointer.
  decoder.jpeg.client_data = &decoder;
  decoder.errors.error_exit = fail;
  decoder.errors.emit_message = listen;
  decoder.progress.progress_monitor = count_scans;
  const bool done = read_rows(&decoder, bytes, size, out, stride);
  jpeg_destroy_decompress(&decoder.jpeg);
  return done              ? ImageFileStatus::ok
         : decoder.damaged ? ImageFileStatus::truncated
                           : ImageFileStatus::undecodable;
}

}  // namespace

const ImageKind kJpeg{kJpegHead, {"\xff\xd8\xff", "\xff\xd8\xff"}, jpeg_size, decode_jpeg};

}  // namespace vergence::app::detail
